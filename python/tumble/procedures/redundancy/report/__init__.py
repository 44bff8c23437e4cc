"""The page of a replayed redundant set."""
