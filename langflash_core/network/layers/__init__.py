"""What every network is made of: attention, decoders, dense prediction."""
