"""The PMI of an SD3000 drive on a UDC."""
