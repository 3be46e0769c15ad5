//! Speeds as a table in Markdown.

use super::contestant::{ALL, KINDS};
use super::hits::Differences;
use super::rounds::Speeds;

/// The place of ours among the contestants.
const OURS: usize = 0;

/// A row for each contestant that took part.
pub fn table(speeds: &Speeds) -> String {
    let mut text = String::from("| Mrays/s | bytes/triangle |");
    KINDS.iter().for_each(|kind| text.push_str(&format!(" {} |", kind.name())));
    text.push_str(" ours/this, any hit | ours/this, closest hit |\n|---|");
    text.push_str(&"---:|".repeat(KINDS.len() + 3));
    text.push('\n');
    for (row, contestant) in ALL.iter().enumerate().filter(|(row, _)| speeds.takes_part(*row)) {
        let bytes = number(speeds.bytes_per_triangle[row]);
        text.push_str(&format!("| {} | {bytes} |", contestant.name()));
        for rounds in &speeds.mrays[row] {
            text.push_str(&format!(" {} |", number(median(rounds))));
        }
        for any_hit in [true, false] {
            text.push_str(&format!(" {} |", number(speeds.mean_ratio(row, any_hit))));
        }
        text.push('\n');
    }
    text
}

/// A sentence about what was found.
pub fn sentence(differences: &Differences) -> String {
    format!(
        "Of {} rays, {} are a hit for only one of raystrips and Embree robust, and {} hit at distances that differ \
         by more than 1e-4 of themselves.",
        differences.rays, differences.hit_or_miss, differences.distance
    )
}

impl Speeds {
    fn takes_part(&self, row: usize) -> bool {
        self.mrays[row].iter().any(|rounds| !rounds.is_empty())
    }

    /// The geometric mean, over the kinds in which `row` takes part, of how much faster ours is.
    fn mean_ratio(&self, row: usize, any_hit: bool) -> Option<f64> {
        let columns = (0..KINDS.len()).filter(|&column| KINDS[column].any_hit == any_hit);
        let logarithms: Vec<f64> =
            columns.filter_map(|column| self.ratio(row, column)).map(f64::ln).collect();
        let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
        (!logarithms.is_empty()).then(|| mean.exp())
    }

    /// The median of the ratios within each round.
    fn ratio(&self, row: usize, column: usize) -> Option<f64> {
        let rounds = self.mrays[OURS][column].iter().zip(&self.mrays[row][column]);
        median(&rounds.map(|(ours, this)| ours / this).collect::<Vec<_>>())
    }
}

fn number(x: Option<f64>) -> String {
    x.map_or("-".into(), |x| format!("{x:.2}"))
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        count if count.is_multiple_of(2) => Some((sorted[middle - 1] + sorted[middle]) / 2.0),
        _ => Some(sorted[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0]), Some(2.5));
    }

    #[test]
    fn ratios_are_taken_within_rounds() {
        let mut speeds = Speeds::default();
        // The machine was slow in the second round; ours is twice as fast in each.
        for column in 0..7 {
            speeds.mrays[OURS][column] = vec![8.0, 2.0, 8.0];
            speeds.mrays[2][column] = vec![4.0, 1.0, 4.0];
        }
        speeds.bytes_per_triangle[2] = Some(85.0);
        assert_eq!(speeds.ratio(2, 0), Some(2.0));
        assert!((speeds.mean_ratio(2, false).unwrap() - 2.0).abs() < 1e-9);
        let table = table(&speeds);
        assert_eq!(table.lines().count(), 4);
        assert!(table.contains("| Embree default | 85.00 | 4.00 |"), "{table}");
        assert!(table.lines().last().unwrap().ends_with("| - | - | - | 2.00 |"), "{table}");
    }
}
