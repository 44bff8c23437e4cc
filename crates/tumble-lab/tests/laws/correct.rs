//! Correction of whole arrays.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble_core::model::{ErrorModel, ModelError};
use tumble_lab::correct::correct;

use super::common::{Draws, cases, rotation, vector};

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn arrays_of_any_length_are_corrected_as_their_samples_are(
        count in prop_oneof![0..10_usize, 16_380..16_390_usize, 30_000..40_000_usize], mounting in rotation(), bias in vector(1.0), seed in any::<u64>()
    ) {
        let mut draws = Draws::new(seed);
        let model = ErrorModel { matrix: mounting.matrix() * 1.02, bias };
        let y: Vec<f64> = (0..3 * count).map(|_| 10.0 * draws.normal()).collect();
        let mut u = vec![f64::NAN; 3 * count];
        prop_assert_eq!(correct(&model, &y, &mut u), Ok(()));
        let correction = model.correction().expect("regular");
        for (y, u) in y.chunks_exact(3).zip(u.chunks_exact(3)) {
            let expected = correction.apply(&Vector3::from_column_slice(y));
            prop_assert!((expected - Vector3::from_column_slice(u)).amax() < 1e-12);
        }
    }
}

#[test]
fn a_matrix_without_inverse_leaves_the_array_as_it_was() {
    let model = ErrorModel {
        matrix: Matrix3::from_element(1.0),
        bias: Vector3::zeros(),
    };
    let mut u = [7.0; 6];
    assert_eq!(correct(&model, &[1.0; 6], &mut u), Err(ModelError::Singular));
    assert_eq!(u, [7.0; 6]);
}
