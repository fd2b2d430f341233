"""Where things end in a photo, by models that this project neither ships nor trains."""
