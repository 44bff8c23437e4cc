//! Output of the device, line by line: each costs one stop of the emulator.

use core::fmt::{Error, Result, Write};

use heapless::String;

use crate::host::{HostFile, Mode};

/// To the host's standard output.
pub struct Console {
    host: HostFile,
    line: String<512>,
}

impl Console {
    /// Asks the host for it.
    pub fn open() -> Option<Self> {
        // Its name for the host's terminal.
        let host = HostFile::open(c":tt", Mode::Write)?;
        Some(Self {
            host,
            line: String::new(),
        })
    }

    /// Sends a line that is not complete.
    pub fn flush(&mut self) {
        self.host.write(self.line.as_bytes());
        self.line.clear();
    }
}

impl Write for Console {
    fn write_str(&mut self, text: &str) -> Result {
        if self.line.push_str(text).is_err() {
            self.flush();
            self.line.push_str(text).map_err(|_| Error)?;
        }
        if text.ends_with('\n') {
            self.flush();
        }
        Ok(())
    }
}
