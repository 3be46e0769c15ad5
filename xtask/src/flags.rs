//! Arguments of tasks: options with a value, switches without one, and the rest.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;

/// Arguments, sorted by kind.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Flags {
    values: BTreeMap<String, String>,
    switches: Vec<String>,
    /// What is neither an option nor a value of one.
    pub rest: Vec<String>,
}

impl Flags {
    /// Takes `options` as names that a value follows and `switches` as names that stand alone; refuses other names.
    pub fn parse(arguments: &[String], options: &[&str], switches: &[&str]) -> Result<Flags> {
        let mut flags = Flags::default();
        let mut arguments = arguments.iter();
        while let Some(argument) = arguments.next() {
            if options.contains(&argument.as_str()) {
                let value = arguments.next().with_context(|| format!("{argument} needs a value after it"))?;
                flags.values.insert(argument.clone(), value.clone());
            } else if switches.contains(&argument.as_str()) {
                flags.switches.push(argument.clone());
            } else if argument.starts_with('-') {
                let known = [options, switches].concat().join(", ");
                bail!("there is no option '{argument}'; there are {known}");
            } else {
                flags.rest.push(argument.clone());
            }
        }
        Ok(flags)
    }

    /// The value of an option.
    pub fn value(&self, name: &str) -> Option<&str> {
        self.values.get(name).map(String::as_str)
    }

    /// The value of an option as a count like `4`, `200K` or `11.7M`.
    pub fn count(&self, name: &str) -> Result<Option<u64>> {
        let count =
            |text| count(text).with_context(|| format!("{name} {text}: not a count like 5, 200K or 11.7M"));
        self.value(name).map(count).transpose()
    }

    /// True where a switch was given.
    pub fn has(&self, switch: &str) -> bool {
        self.switches.iter().any(|s| s == switch)
    }
}

/// A number with a decimal unit.
fn count(text: &str) -> Option<u64> {
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let unit = match unit {
        "" => return number.parse().ok(),
        "K" | "k" => 1e3,
        "M" => 1e6,
        "G" => 1e9,
        _ => return None,
    };
    let count = number.parse::<f64>().ok()? * unit;
    (0.0..1e18).contains(&count).then_some(count.round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Flags> {
        let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        Flags::parse(&arguments, &["--seed", "-o"], &["--quiet"])
    }

    #[test]
    fn kinds_are_told_apart() {
        let flags = parse("a --seed 7 --quiet b").unwrap();
        assert_eq!(flags.rest, ["a", "b"]);
        assert_eq!(flags.count("--seed").unwrap(), Some(7));
        assert!(flags.has("--quiet") && flags.value("-o").is_none());
        assert!(parse("--sed 7").is_err() && parse("--seed").is_err());
        assert!(parse("--seed x").unwrap().count("--seed").is_err());
    }

    #[test]
    fn counts() {
        assert_eq!(["12", "200K", "11.7M"].map(count), [Some(12), Some(200_000), Some(11_700_000)]);
        assert_eq!(["", "M", "-1K", "1.5", "3X"].map(count), [None; 5]);
    }
}
