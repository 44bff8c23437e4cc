"""The pages of a turntable session: one for the batch, one a target."""
