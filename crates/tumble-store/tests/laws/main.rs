//! Laws of the store: what a record is in bytes, and what flash keeps of it whatever happens.

mod checksum;
mod common;
mod corruption;
mod drift_record;
mod ecc;
mod flash;
mod layout;
mod magnetometer_record;
mod marginal;
mod older_versions;
mod power_cut;
mod record;
mod wire_format;
