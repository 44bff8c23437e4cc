"""One unit on a turntable in a climate chamber: the same session at several temperatures."""
