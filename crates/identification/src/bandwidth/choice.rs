//! Fits compared by their errors on folds left out: decisions on plain numbers.

use super::BandwidthSettings;

/// What a fit saves of another's error variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Mean over the joints of the share of their error variance that it saves; below zero where it is worse.
    pub saving: f64,
    /// The standard error of that, from the scatter over the folds.
    pub standard_error: f64,
}

/// Each fit beside the one at `reference`. `squares` holds a fit's sum of squared errors of each fold left
/// out, by joint.
pub fn compare(squares: &[Vec<Vec<f64>>], reference: usize) -> Vec<Comparison> {
    let Some(own) = squares.get(reference) else { return Vec::new() };
    let joints = own.first().map_or(0, Vec::len);
    let totals: Vec<f64> = (0..joints).map(|joint| own.iter().map(|fold| fold[joint]).sum()).collect();
    let judged: Vec<usize> = (0..joints).filter(|&joint| totals[joint] > 0.0).collect();
    let count = own.len() as f64;
    let compare = |other: &Vec<Vec<f64>>| {
        let saved = |(own, other): (&Vec<f64>, &Vec<f64>)| {
            let share = |&joint: &usize| (own[joint] - other[joint]) / totals[joint];
            judged.iter().map(share).sum::<f64>() / judged.len().max(1) as f64
        };
        let saved: Vec<f64> = own.iter().zip(other).map(saved).collect();
        let saving: f64 = saved.iter().sum();
        let scatter: f64 = saved.iter().map(|saved| (saved - saving / count).powi(2)).sum();
        Comparison { saving, standard_error: (scatter * count / (count - 1.0)).sqrt() }
    };
    squares.iter().map(compare).collect()
}

/// The fit that saves most, among those that save more than the folds' scatter explains.
pub fn better(comparisons: &[Comparison], settings: &BandwidthSettings) -> Option<usize> {
    let certain = |comparison: &Comparison| {
        comparison.saving > settings.saving.max(settings.standard_errors * comparison.standard_error)
    };
    let certain = comparisons.iter().enumerate().filter(|(_, comparison)| certain(comparison));
    certain.max_by(|a, b| a.1.saving.total_cmp(&b.1.saving)).map(|(fit, _)| fit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_joint_counts_by_its_own_error() {
        // Two folds of two joints, whose errors differ a hundred times.
        let own = vec![vec![2.0, 200.0], vec![2.0, 200.0]];
        let other = vec![vec![1.0, 200.0], vec![1.0, 200.0]];
        let comparisons = compare(&[own.clone(), other], 0);
        assert_eq!(comparisons[0], Comparison::default());
        assert_eq!(comparisons[1], Comparison { saving: 0.25, standard_error: 0.0 });
        // A joint without any error, one that never moves, has no say.
        let still = |folds: &[Vec<f64>]| folds.iter().map(|fold| vec![fold[0], 0.0]).collect::<Vec<_>>();
        assert_eq!(compare(&[still(&own), still(&own)], 0)[1], Comparison::default());
    }

    #[test]
    fn the_standard_error_is_that_of_a_sum_over_folds() {
        let folds = |errors: [f64; 4]| errors.iter().map(|&error| vec![error]).collect::<Vec<_>>();
        let comparisons = compare(&[folds([1.0; 4]), folds([0.5, 1.0, 0.5, 1.0])], 0);
        // Savings of 1/8 and 0 in turn: their variance is 1/192, four times that the sum's.
        assert!((comparisons[1].saving - 0.25).abs() < 1e-12);
        assert!((comparisons[1].standard_error - (4.0_f64 / 192.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn only_a_certain_and_material_saving_is_better() {
        let settings = BandwidthSettings { standard_errors: 3.0, saving: 0.02, ..Default::default() };
        let check = |cases: &[(f64, f64)], expected: Option<usize>| {
            let comparison = |&(saving, standard_error): &(f64, f64)| Comparison { saving, standard_error };
            let comparisons: Vec<Comparison> = cases.iter().map(comparison).collect();
            assert_eq!(better(&comparisons, &settings), expected, "{cases:?}");
        };
        check(&[], None);
        check(&[(0.0, 0.0), (-0.5, 0.1)], None);
        check(&[(0.10, 0.05), (0.0, 0.0)], None);
        check(&[(0.01, 0.001), (0.0, 0.0)], None);
        check(&[(0.10, 0.03), (0.0, 0.0)], Some(0));
        check(&[(0.10, 0.03), (0.0, 0.0), (0.2, 0.05), (0.5, 0.4)], Some(2));
        check(&[(f64::NAN, f64::NAN), (0.0, 0.0)], None);
    }
}
