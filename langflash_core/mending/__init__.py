"""What a person takes out of a scene: parts hidden for privacy, clean-up by recipes, holes filled."""
