"""Programs that join a rack from outside: the operator's client, the recorder, the player."""
