"""Movement in notebooks: what plays in a cell, and a widget that Python and the page share."""
