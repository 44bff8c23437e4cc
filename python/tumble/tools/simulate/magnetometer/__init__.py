"""One unit with a magnetometer, turned by hand in the Earth's field."""
