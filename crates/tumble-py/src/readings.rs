//! Readings of a log, put in place and looked over in one pass each, where numpy would make several.

use numpy::ndarray::{ArrayViewMut1, Zip};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn, PyReadwriteArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tumble_lab::acquisition::{self, CHANNEL_NAMES};

use crate::convert::rows;

/// Numbers that are looked at side by side: enough for the vectors of any processor.
const LANES: usize = 8;

/// Puts three columns of numbers into the rows of a contiguous (n, 3) array from `first` on.
#[pyfunction]
fn gather<'py>(
    py: Python<'py>,
    mut target: PyReadwriteArray2<'py, f64>,
    first: usize,
    x: PyReadonlyArray1<'py, f64>,
    y: PyReadonlyArray1<'py, f64>,
    z: PyReadonlyArray1<'py, f64>,
) -> PyResult<()> {
    let (x, y, z) = (x.as_array(), y.as_array(), z.as_array());
    let (rows, _) = target.as_slice_mut()?.as_chunks_mut::<3>();
    let rows = rows
        .get_mut(first..first + x.len())
        .filter(|_| y.len() == x.len() && z.len() == x.len())
        .ok_or_else(|| PyValueError::new_err("columns must have one length, and fit in the target"))?;
    py.detach(|| {
        Zip::from(ArrayViewMut1::from(rows))
            .and(x)
            .and(y)
            .and(z)
            .for_each(|row, &x, &y, &z| *row = [x, y, z]);
    });
    Ok(())
}

/// Largest absolute value; NaN where one is not finite.
fn largest_of(values: &[f64]) -> f64 {
    let (blocks, rest) = values.as_chunks::<LANES>();
    let (mut largest, mut finite) = ([0.0_f64; LANES], [0.0_f64; LANES]);
    for block in blocks {
        for ((value, largest), finite) in block.iter().zip(&mut largest).zip(&mut finite) {
            *largest = if value.abs() > *largest {
                value.abs()
            } else {
                *largest
            };
            *finite += 0.0 * value;
        }
    }
    let sound = finite.iter().sum::<f64>() + rest.iter().map(|value| 0.0 * value).sum::<f64>();
    let found = largest
        .iter()
        .copied()
        .chain(rest.iter().map(|value| value.abs()));
    found.fold(0.0, f64::max) + sound
}

/// Largest absolute value of an array of any shape, 0 where it is empty; NaN where a number is not finite.
#[pyfunction]
fn largest(py: Python<'_>, values: PyReadonlyArrayDyn<'_, f64>) -> f64 {
    let values = values.as_array();
    let values = values.as_standard_layout();
    py.detach(|| values.as_slice().map_or(f64::NAN, largest_of))
}

/// Rows of (n, 3) readings of a triad, SI, whose read failed.
#[pyfunction]
fn failed_reads(py: Python<'_>, readings: PyReadonlyArray2<'_, f64>) -> PyResult<Vec<usize>> {
    let readings = rows(&readings, "readings")?;
    Ok(py.detach(|| acquisition::failed_reads(readings)))
}

/// Compares the medians of every second, third and fourth sample, block by block.
#[pyclass(module = "tumble._core", name = "AlternationWatch")]
#[derive(Default)]
pub struct PyAlternationWatch {
    watch: acquisition::AlternationWatch,
}

#[pymethods]
impl PyAlternationWatch {
    /// Nothing seen yet.
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Takes in successive readings, (n, 3) SI each; None of a triad that was not recorded.
    fn push(
        &mut self,
        py: Python<'_>,
        accelerometer: Option<PyReadonlyArray2<'_, f64>>,
        gyroscope: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<()> {
        let triads = [
            recorded(accelerometer.as_ref(), "accelerometer")?,
            recorded(gyroscope.as_ref(), "gyroscope")?,
        ];
        py.detach(|| self.watch.push(triads));
        Ok(())
    }

    /// Number of units that take turns; 1 where nothing shows that it is more than one.
    #[getter]
    fn units(&self) -> usize {
        self.watch.units()
    }
}

/// Rows of a triad that may not have been recorded.
fn recorded<'a>(
    array: Option<&'a PyReadonlyArray2<'_, f64>>,
    name: &str,
) -> PyResult<Option<&'a [[f64; 3]]>> {
    array.map(|each| rows(each, name)).transpose()
}

/// A channel that repeated one reading while others went on: name, value SI, first s, last s.
type Stuck = (&'static str, f64, f64, f64);

/// Stretches, by first and last place, in which all recorded channels repeated their readings, and channels that did so alone.
#[pyfunction]
#[pyo3(signature = (time, accelerometer, gyroscope))]
fn standstills(
    py: Python<'_>,
    time: PyReadonlyArray1<'_, f64>,
    accelerometer: Option<PyReadonlyArray2<'_, f64>>,
    gyroscope: Option<PyReadonlyArray2<'_, f64>>,
) -> PyResult<(Vec<acquisition::Repetition>, Vec<Stuck>)> {
    let force = recorded(accelerometer.as_ref(), "accelerometer")?;
    let rate = recorded(gyroscope.as_ref(), "gyroscope")?;
    let time = time.as_slice()?;
    if [force, rate]
        .iter()
        .flatten()
        .any(|each| each.len() != time.len())
    {
        return Err(PyValueError::new_err(
            "time, accelerometer and gyroscope must have the same length",
        ));
    }
    let found = py.detach(|| acquisition::standstills(time, [force, rate]));
    let stuck = found.stuck.iter().map(|each| {
        let (first, last) = each.run;
        (CHANNEL_NAMES[each.channel], each.value, time[first], time[last])
    });
    Ok((found.frozen, stuck.collect()))
}

/// Numbers of (n,) times that are before the one before them, or not comparable with it, and that equal it.
#[pyfunction]
fn steps(py: Python<'_>, time: PyReadonlyArray1<'_, f64>) -> (usize, usize) {
    let time = time.as_array();
    py.detach(|| {
        let (mut rising, mut equal) = (0, 0);
        for (before, after) in time.iter().zip(time.iter().skip(1)) {
            rising += usize::from(after > before);
            equal += usize::from(after == before);
        }
        (time.len().saturating_sub(1) - rising - equal, equal)
    })
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyAlternationWatch>()?;
    module.add_function(wrap_pyfunction!(failed_reads, module)?)?;
    module.add_function(wrap_pyfunction!(gather, module)?)?;
    module.add_function(wrap_pyfunction!(largest, module)?)?;
    module.add_function(wrap_pyfunction!(standstills, module)?)?;
    module.add("FROZEN", acquisition::FROZEN)?;
    module.add_function(wrap_pyfunction!(steps, module)?)
}
