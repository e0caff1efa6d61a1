"""Bodies drawn: solids, depth buffer and colours; pictures, films, and a page that plays a motion."""

PICTURES = (".png", ".gif", ".mp4", ".svg", ".html")  # suffixes that `pictures.draw_picture` writes
SOUNDING = (".mp4", ".html")  # pictures that may have sound
