"""Parts of Tumble that work on this machine, and instructions to install the others."""
