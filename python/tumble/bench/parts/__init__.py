"""Parts of the screens: texts, buttons, fields, lamps, bars, and the body in 3D."""
