"""The page of a drift over temperature."""
