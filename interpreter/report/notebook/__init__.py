"""What a notebook shows of a scene, a report, a comparison or a stability study: a piece of HTML within its page.

`box_frame.py` is what they share. Each is readable as plain HTML where styles and scripts are taken away, needs no
network and is of bounded size; what scripts draw stands in a frame of its own, whose names and styles touch nothing
else.
"""
