use super::*;
use crate::redundancy::settings::RedundancySettings;

const FIT: SourceCandidate<f32> = SourceCandidate {
    healthy: true,
    condition: Condition::Silent,
    healthy_for: 0,
    calibrated: true,
    residual: 0.1,
};

const ILL: SourceCandidate<f32> = SourceCandidate {
    healthy: false,
    ..FIT
};

const HOLD: u64 = 20_000;

fn settings(return_after: Option<u64>) -> SelectionSettings {
    SelectionSettings {
        return_after,
        ..SelectionSettings::default()
    }
}

fn among(candidates: &[SourceCandidate<f32>]) -> impl Fn(usize) -> Option<SourceCandidate<f32>> {
    |unit| candidates.get(unit).copied()
}

fn started(settings: &SelectionSettings) -> Selection {
    let mut selection = Selection::new();
    let change = selection.update(0, &among(&[FIT; 3]), settings);
    assert_eq!(change, to(0, SelectionReason::Start));
    selection
}

fn to(source: usize, reason: SelectionReason) -> Option<Change> {
    Some(Change {
        source: Some(source),
        reason,
    })
}

#[test]
fn the_primary_is_first() {
    assert_eq!(started(&settings(None)).source(), Some(0));
}

#[test]
fn a_primary_missing_from_the_start_is_replaced_after_a_wait() {
    let mut selection = Selection::new();
    assert_eq!(selection.update(5, &among(&[ILL, FIT]), &settings(None)), None);
    let change = selection.update(5 + HOLD, &among(&[ILL, FIT]), &settings(None));
    assert_eq!(change, to(1, SelectionReason::PrimaryFailed));
}

#[test]
fn a_source_that_is_ill_for_less_than_the_hold_stays() {
    let mut selection = started(&settings(None));
    for round in 0..100 {
        let time = round * 2 * HOLD;
        assert_eq!(
            selection.update(time, &among(&[ILL, FIT, FIT]), &settings(None)),
            None
        );
        assert_eq!(
            selection.update(time + HOLD - 1, &among(&[ILL, FIT, FIT]), &settings(None)),
            None
        );
        assert_eq!(
            selection.update(time + HOLD, &among(&[FIT; 3]), &settings(None)),
            None
        );
    }
}

#[test]
fn a_source_that_is_ill_for_the_hold_is_replaced_by_the_best() {
    let candidate = |calibrated, residual| SourceCandidate {
        calibrated,
        residual,
        ..FIT
    };
    let cases = [
        ([candidate(false, 0.0), candidate(true, 0.9)], 2),
        ([candidate(true, 0.2), candidate(true, 0.1)], 2),
        ([candidate(true, f32::NAN), candidate(true, 0.9)], 2),
        ([candidate(true, 0.9), candidate(true, f32::NAN)], 1),
        ([candidate(true, 0.1), candidate(true, 0.1)], 1),
        ([candidate(false, f32::NAN), candidate(false, f32::NAN)], 1),
        ([ILL, candidate(false, 0.1)], 2),
    ];
    for ([first, second], best) in cases {
        let mut selection = started(&settings(None));
        let candidates = [ILL, first, second];
        selection.update(100, &among(&candidates), &settings(None));
        let change = selection.update(100 + HOLD, &among(&candidates), &settings(None));
        assert_eq!(change, to(best, SelectionReason::PrimaryFailed), "{candidates:?}");
    }
}

fn failed_over(settings: &SelectionSettings) -> Selection {
    let mut selection = started(settings);
    selection.update(0, &among(&[ILL, FIT, FIT]), settings);
    selection.update(HOLD, &among(&[ILL, FIT, FIT]), settings);
    assert_eq!(selection.source(), Some(1));
    selection
}

#[test]
fn the_primary_returns_only_on_command_while_others_are_usable() {
    let mut selection = failed_over(&settings(None));
    let proven = SourceCandidate {
        healthy_for: u64::MAX,
        ..FIT
    };
    for time in 1..1_000 {
        assert_eq!(
            selection.update(time * HOLD, &among(&[proven, FIT, FIT]), &settings(None)),
            None
        );
    }
    let others = [proven, ILL, FIT];
    selection.update(1_000 * HOLD, &among(&others), &settings(None));
    let change = selection.update(1_001 * HOLD, &among(&others), &settings(None));
    assert_eq!(change, to(2, SelectionReason::SourceFailed));
    let nobody_else = [proven, ILL, ILL];
    selection.update(1_002 * HOLD, &among(&nobody_else), &settings(None));
    let change = selection.update(1_003 * HOLD, &among(&nobody_else), &settings(None));
    assert_eq!(change, to(0, SelectionReason::SourceFailed));
}

#[test]
fn a_command_returns_a_healthy_primary_and_is_else_discarded() {
    let mut selection = failed_over(&settings(None));
    selection.command_primary();
    assert_eq!(
        selection.update(1, &among(&[ILL, FIT, FIT]), &settings(None)),
        None
    );
    assert_eq!(selection.update(2, &among(&[FIT; 3]), &settings(None)), None);
    selection.command_primary();
    assert_eq!(
        selection.update(3, &among(&[FIT; 3]), &settings(None)),
        to(0, SelectionReason::Command)
    );
}

#[test]
fn a_primary_that_has_proven_healthy_comes_back() {
    let settings = settings(Some(1_000_000));
    let mut selection = failed_over(&settings);
    let healthy_for = |healthy_for| [SourceCandidate { healthy_for, ..FIT }, FIT, FIT];
    assert_eq!(
        selection.update(1, &among(&healthy_for(999_999)), &settings),
        None
    );
    assert_eq!(
        selection.update(2, &among(&healthy_for(1_000_000)), &settings),
        to(0, SelectionReason::PrimaryProven)
    );
}

#[test]
fn where_nobody_is_fit_there_is_no_source_until_somebody_is() {
    let mut selection = started(&settings(None));
    selection.update(0, &among(&[ILL; 3]), &settings(None));
    let none = Change {
        source: None,
        reason: SelectionReason::NoneFit,
    };
    assert_eq!(
        selection.update(HOLD, &among(&[ILL; 3]), &settings(None)),
        Some(none)
    );
    assert_eq!(
        selection.update(2 * HOLD, &among(&[ILL; 3]), &settings(None)),
        None
    );
    assert_eq!(selection.source(), None);
    assert_eq!(
        selection.update(3 * HOLD, &among(&[ILL, ILL, FIT]), &settings(None)),
        to(2, SelectionReason::PrimaryFailed)
    );
}

#[test]
fn uncalibrated_secondaries_are_passed_over_where_that_is_asked() {
    let settings = SelectionSettings {
        calibrated_only: true,
        ..settings(None)
    };
    let raw = SourceCandidate {
        calibrated: false,
        ..FIT
    };
    let mut selection = started(&settings);
    selection.update(0, &among(&[ILL, raw, FIT]), &settings);
    assert_eq!(
        selection.update(HOLD, &among(&[ILL, raw, FIT]), &settings),
        to(2, SelectionReason::PrimaryFailed)
    );
    selection.update(HOLD, &among(&[ILL, raw, ILL]), &settings);
    let change = selection.update(2 * HOLD, &among(&[ILL, raw, ILL]), &settings);
    assert_eq!(change.map(|change| change.source), Some(None));
}

#[test]
fn time_that_goes_back_does_not_hold_a_failed_source() {
    let mut selection = started(&settings(None));
    selection.update(u64::MAX, &among(&[ILL, FIT]), &settings(None));
    assert_eq!(selection.update(0, &among(&[ILL, FIT]), &settings(None)), None);
    let change = selection.update(HOLD, &among(&[ILL, FIT]), &settings(None));
    assert_eq!(change, to(1, SelectionReason::PrimaryFailed));
}

#[test]
fn a_return_sooner_than_the_failover_is_refused() {
    let returning = |after| {
        let all = RedundancySettings::<f32> {
            selection: settings(after),
            ..RedundancySettings::default()
        };
        all.validate()
    };
    assert!(returning(Some(HOLD)).is_err());
    assert!(returning(Some(HOLD + 1)).is_ok());
    assert!(returning(None).is_ok());
}

fn ill_as(condition: Condition) -> SourceCandidate<f32> {
    SourceCandidate { condition, ..ILL }
}

#[test]
fn a_doubtful_source_stays_while_no_other_unit_is_usable() {
    let mut selection = started(&settings(None));
    let set = [ill_as(Condition::Doubtful), ILL, ILL];
    for time in (0..10 * HOLD).step_by(1000) {
        assert_eq!(selection.update(time, &among(&set), &settings(None)), None);
    }
    let set = [ill_as(Condition::Doubtful), ILL, FIT];
    let change = selection.update(10 * HOLD, &among(&set), &settings(None));
    assert_eq!(change, to(2, SelectionReason::PrimaryFailed));
}

#[test]
fn a_saturating_source_is_replaced_only_by_a_calm_one() {
    let mut selection = started(&settings(None));
    let calm_for = |healthy_for| {
        [
            ill_as(Condition::Saturated),
            SourceCandidate { healthy_for, ..FIT },
        ]
    };
    for time in (0..2 * SATURATED_HOLD).step_by(1000) {
        let set = calm_for(CALM - 1);
        assert_eq!(selection.update(time, &among(&set), &settings(None)), None);
    }
    let change = selection.update(2 * SATURATED_HOLD, &among(&calm_for(CALM)), &settings(None));
    assert_eq!(change, to(1, SelectionReason::PrimaryFailed));
}

#[test]
fn the_first_sample_of_a_primary_may_be_late() {
    let mut selection = Selection::new();
    let late = 5 * HOLD;
    assert!(selection.awaits_the_first(0, late));
    assert!(selection.awaits_the_first(late - 1, late));
    assert!(!selection.awaits_the_first(late, late));
    // Beyond that it has failed for longer than any source may.
    let change = selection.update(late, &among(&[ILL, FIT]), &settings(None));
    assert_eq!(change, to(1, SelectionReason::PrimaryFailed));
    assert!(!selection.awaits_the_first(late, late));
}
