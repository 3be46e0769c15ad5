//! Lines over a logarithmic axis, as SVG.

use std::fmt::Write;

/// A line: its name and its points.
pub type Line = (String, Vec<(f64, f64)>);

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
/// Room for numbers and names.
const LEFT: f64 = 70.0;
const BOTTOM: f64 = 50.0;
const RIGHT: f64 = 130.0;
const TOP: f64 = 20.0;
/// Of text.
const LINE_HEIGHT: f64 = 14.0;
const COLORS: [&str; 7] = ["#1b6ca8", "#c8553d", "#588b3d", "#7d4fa0", "#b8860b", "#444444", "#1aa0a0"];

/// Draws lines over axes with these names; both are logarithmic.
pub fn lines(x_name: &str, y_name: &str, lines: &[Line]) -> String {
    let points = || lines.iter().flat_map(|(_, points)| points.iter().copied());
    let range = |of: fn((f64, f64)) -> f64| {
        let (least, greatest) =
            points().map(of).fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
        (least.log10().floor(), greatest.log10().ceil().max(least.log10().floor() + 1.0))
    };
    let (x_range, y_range) = (range(|p| p.0), range(|p| p.1));
    let place = |value: f64, (least, greatest): (f64, f64)| (value.log10() - least) / (greatest - least);
    let x_of = |x: f64| LEFT + place(x, x_range) * (WIDTH - LEFT - RIGHT);
    let y_of = |y: f64| HEIGHT - BOTTOM - place(y, y_range) * (HEIGHT - BOTTOM - TOP);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut text = |x: f64, y: f64, anchor: &str, what: &str| {
        _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{what}</text>");
    };
    text((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 10.0, "middle", x_name);
    text(4.0, TOP - 6.0, "start", y_name);
    let decades = |(least, greatest): (f64, f64)| (least as i32..=greatest as i32).map(|e| 10f64.powi(e));
    for x in decades(x_range) {
        text(x_of(x), HEIGHT - BOTTOM + 18.0, "middle", &x.to_string());
    }
    for y in decades(y_range) {
        text(LEFT - 6.0, y_of(y) + 4.0, "end", &y.to_string());
    }
    let end = |points: &[(f64, f64)]| points.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
    let colored = || lines.iter().zip(COLORS.iter().cycle());
    let ends = colored().filter_map(|((name, points), color)| Some((end(points)?, name, color)));
    let mut names: Vec<(f64, f64, &str, &str)> =
        ends.map(|((x, y), name, color)| (y_of(y) + 4.0, x_of(x) + 8.0, name.as_str(), *color)).collect();
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::NEG_INFINITY;
    for (y, x, name, color) in names {
        // Lines may end at the same place.
        let y = y.max(least);
        _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"start\" fill=\"{color}\">{name}</text>"
        );
        least = y + LINE_HEIGHT;
    }
    for y in decades(y_range) {
        let y = y_of(y);
        let end = WIDTH - RIGHT;
        _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" y1=\"{y:.1}\" x2=\"{end}\" y2=\"{y:.1}\" stroke=\"#dddddd\"/>"
        );
    }
    for ((_, points), color) in colored() {
        let path: Vec<String> =
            points.iter().map(|&(x, y)| format!("{:.1},{:.1}", x_of(x), y_of(y))).collect();
        _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
            path.join(" ")
        );
        for point in path {
            let (x, y) = point.split_once(',').unwrap_or_default();
            _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"3\" fill=\"{color}\"/>");
        }
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_within_the_picture() {
        let svg =
            lines("part", "rate", &[("a".into(), vec![(6.0, 0.02), (100.0, 3.0)]), ("b".into(), vec![])]);
        let numbers = |name: &str| -> Vec<f64> {
            svg.split(&format!("{name}=\""))
                .skip(1)
                .filter_map(|s| s.split('"').next()?.parse().ok())
                .collect()
        };
        assert_eq!(numbers("cx").len(), 2);
        assert!(numbers("cx").iter().all(|&x| (LEFT..=WIDTH - RIGHT).contains(&x)));
        assert!(numbers("cy").iter().all(|&y| (TOP..=HEIGHT - BOTTOM).contains(&y)));
    }

    #[test]
    fn names_of_lines_that_end_together_are_apart() {
        let line = |name: &str| (name.to_owned(), vec![(10.0, 1.0), (100.0, 2.0)]);
        let svg = lines("part", "rate", &[line("first"), line("second")]);
        let place = |name: &str| -> f64 {
            let text = svg.lines().find(|line| line.ends_with(&format!(">{name}</text>"))).unwrap();
            text.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        assert!((place("first") - place("second")).abs() >= LINE_HEIGHT);
    }
}
