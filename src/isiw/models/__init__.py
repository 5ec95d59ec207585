"""Models of a person's responses, behind the protocol of `isiw.models.protocol`."""
