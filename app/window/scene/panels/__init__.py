"""The tray, the modes, the views."""
