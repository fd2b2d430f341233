"""Files of the scene, by the program of the command line."""
