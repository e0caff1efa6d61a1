"""Pictures of postures and of movement, from bodies down to pixels, curves and pages."""

PICTURES = (".png", ".gif", ".mp4", ".svg", ".html")  # how the files end that `pictures.write_picture` writes
