"""The messages of a rack: definitions, CDR, quality of service, the stream that nodes and recordings share."""
