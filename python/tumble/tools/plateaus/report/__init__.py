"""The page of a calibration over temperature."""
