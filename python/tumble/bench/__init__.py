"""Pages in the browser, served on this computer. Only this room imports NiceGUI."""
