"""Tests of webs, rolls, rollers and dancers."""
