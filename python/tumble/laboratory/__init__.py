"""A laboratory's record: which unit was calibrated, against which reference, how well, until when."""
