//! What the device says, line by line: each costs one stop of the emulator.

use core::fmt::{Error, Result, Write};

use cortex_m_semihosting::hio::{self, HostStream};
use heapless::String;

/// To the host's standard output.
pub struct Console {
    host: HostStream,
    line: String<512>,
}

impl Console {
    /// Asks the host for it.
    pub fn open() -> Option<Self> {
        let host = hio::hstdout().ok()?;
        Some(Self {
            host,
            line: String::new(),
        })
    }

    /// Says what is not yet a line.
    pub fn flush(&mut self) {
        let said = self.host.write_all(self.line.as_bytes());
        // A host that does not listen cannot be told so.
        let _ = said;
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
