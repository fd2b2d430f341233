"""From phrases to answers: text towers, relevance, prompt algebra, masks and boxes."""
