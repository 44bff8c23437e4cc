//! The native module `tumble._core`: converts arrays, releases the GIL, holds no mathematics.

use pyo3::prelude::*;

mod acquisition;
mod align;
mod convert;
mod correct;
mod distributions;
mod magnetometer;
mod multipose;
mod noise;
mod readings;
mod record;
mod redundancy;
mod redundancy_values;
mod rotation;
mod set_monitor;
mod settings;
mod simulate;
mod simulate_flight;
mod simulate_spin;
mod spin;
mod spin_figures;
mod spin_machine;
mod stamps;
mod thermal;
mod turntable;
mod vocabulary;

/// Module entry point.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    acquisition::register(module)?;
    align::register(module)?;
    correct::register(module)?;
    distributions::register(module)?;
    magnetometer::register(module)?;
    multipose::register(module)?;
    noise::register(module)?;
    readings::register(module)?;
    record::register(module)?;
    redundancy::register(module)?;
    rotation::register(module)?;
    set_monitor::register(module)?;
    settings::register(module)?;
    simulate::register(module)?;
    simulate_flight::register(module)?;
    simulate_spin::register(module)?;
    spin::register(module)?;
    spin_machine::register(module)?;
    stamps::register(module)?;
    thermal::register(module)?;
    turntable::register(module)?;
    vocabulary::register(module)?;
    module.add("STANDARD_GRAVITY", tumble_core::gravity::STANDARD)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
