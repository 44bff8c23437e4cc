"""A flight or drive: several units on a quadrotor or a vehicle."""
