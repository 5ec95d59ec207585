"""Text: from outside, made harmless; TOML files, checked key by key; words for stimuli, numbers and what was found."""
