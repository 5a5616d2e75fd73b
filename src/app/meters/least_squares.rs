//! Linear least squares with bounds, for a few unknowns.

/// Minimises |A·x − b|² within `low ≤ x ≤ high`. `rows` are those of A, with as many columns as
/// `high` has entries; A has full column rank.
///
/// A projected Newton method [Bertsekas 1982]: unknowns at a bound that the gradient presses
/// against it stay, the others take a Newton step, which is shortened until the error decreases.
pub(super) fn solve(rows: &[Vec<f64>], b: &[f64], low: f64, high: &[f64]) -> Vec<f64> {
    /// Steps at most; a few suffice for a few unknowns.
    const STEPS: usize = 200;
    let count = high.len();
    let dot = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let gram: Vec<Vec<f64>> = (0..count).map(|i| (0..count).map(|j| dot(i, j)).collect()).collect();
    let right: Vec<f64> =
        (0..count).map(|i| rows.iter().zip(b).map(|(row, b)| row[i] * b).sum::<f64>()).collect();
    // Half of the error less a constant, and its gradient.
    let gradient = |x: &[f64]| -> Vec<f64> {
        let row =
            |(row, right): (&Vec<f64>, &f64)| row.iter().zip(x).map(|(g, x)| g * x).sum::<f64>() - right;
        gram.iter().zip(&right).map(row).collect()
    };
    let error = |x: &[f64]| -> f64 {
        x.iter().zip(gradient(x)).zip(&right).map(|((x, slope), right)| 0.5 * x * (slope - right)).sum()
    };
    let mut x: Vec<f64> = high.iter().map(|&high| 1f64.clamp(low, high)).collect();
    for _ in 0..STEPS {
        let slope = gradient(&x);
        let is_free = |&i: &usize| !(x[i] <= low && slope[i] > 0.0 || x[i] >= high[i] && slope[i] < 0.0);
        let free: Vec<usize> = (0..count).filter(is_free).collect();
        let matrix = free.iter().map(|&i| free.iter().map(|&j| gram[i][j]).collect()).collect();
        let step = cholesky(matrix, free.iter().map(|&i| -slope[i]).collect());
        let before = error(&x);
        let mut length = 1.0;
        let next = loop {
            let mut next = x.clone();
            for (&i, step) in free.iter().zip(&step) {
                next[i] = (x[i] + length * step).clamp(low, high[i]);
            }
            if error(&next) <= before || length < 1e-12 {
                break next;
            }
            length *= 0.5;
        };
        let moved = next.iter().zip(&x).map(|(next, x)| (next - x).abs()).fold(0.0, f64::max);
        x = next;
        if moved <= 1e-12 {
            break;
        }
    }
    x
}

/// Solves a symmetric positive definite system.
fn cholesky(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let count = right.len();
    for j in 0..count {
        for i in j..count {
            let sum: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let value = matrix[i][j] - sum;
            matrix[i][j] = if i == j { value.max(f64::MIN_POSITIVE).sqrt() } else { value / matrix[j][j] };
        }
    }
    for i in 0..count {
        let sum: f64 = (0..i).map(|k| matrix[i][k] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i][i];
    }
    for i in (0..count).rev() {
        let sum: f64 = (i + 1..count).map(|k| matrix[k][i] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i][i];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash_pair;

    #[test]
    fn systems_are_solved() {
        let found = solve(&[vec![2.0, 1.0], vec![1.0, 3.0]], &[5.0, 10.0], 0.0, &[f64::INFINITY; 2]);
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 3.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn bounds_hold_and_the_others_make_the_best_of_it() {
        // Without bounds x = (-1, 3).
        let rows = [vec![1.0, 1.0], vec![1.0, 0.0]];
        assert_eq!(solve(&rows, &[2.0, -1.0], 0.0, &[f64::INFINITY; 2]), [0.0, 2.0]);
        assert_eq!(solve(&rows, &[2.0, -1.0], 0.0, &[9.0, 1.5]), [0.0, 1.5]);
    }

    /// The conditions of Karush, Kuhn and Tucker hold for random systems.
    #[test]
    fn no_change_within_the_bounds_is_better() {
        let random = |seed: u32, i: usize| f64::from(hash_pair(seed, i as u32)) / f64::from(u32::MAX);
        let mut at_bounds = 0;
        for seed in 0..200 {
            let count = 1 + seed as usize % 9;
            let rows: Vec<Vec<f64>> = (0..count + 3)
                .map(|row| (0..count).map(|column| random(seed, 20 * row + column)).collect())
                .collect();
            let b: Vec<f64> = (0..count + 3).map(|row| 4.0 * random(seed, 1000 + row) - 1.0).collect();
            let high: Vec<f64> = (0..count).map(|i| 0.5 + random(seed, 2000 + i)).collect();
            let x = solve(&rows, &b, 0.0, &high);
            for i in 0..count {
                let slope: f64 = rows
                    .iter()
                    .zip(&b)
                    .map(|(row, b)| row[i] * (row.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() - b))
                    .sum();
                at_bounds += usize::from(x[i] == 0.0 || x[i] == high[i]);
                let is_best = match x[i] {
                    0.0 => slope >= -1e-9,
                    x if x == high[i] => slope <= 1e-9,
                    _ => slope.abs() < 1e-9,
                };
                assert!(is_best && (0.0..=high[i]).contains(&x[i]), "{seed}: {x:?}, {slope}");
            }
        }
        assert!(at_bounds > 100, "{at_bounds}");
    }
}
