"""`langflash export --segmented`: every view of a scene taken apart by phrases, in one folder."""
