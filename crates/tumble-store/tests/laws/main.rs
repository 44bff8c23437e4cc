//! Laws of the store: what a record is in bytes, and what flash keeps of it whatever happens.

mod common;
mod corruption;
mod drift_record;
mod flash;
mod layout;
mod marginal;
mod power_cut;
mod record;
