"""SROS 2: who may publish and subscribe to what in a rack's graph."""
