"""The log of record: one MCAP file a session, events in, events out."""
