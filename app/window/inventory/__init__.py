"""What is in the room: things in a list beside the picture, with names, sizes and how sure they are."""
