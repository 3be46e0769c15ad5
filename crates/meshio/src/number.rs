//! Numbers in text, as lenient as the programs that write them are sloppy.

/// 10^0 to 10^22: the powers of ten that `f64` holds exactly.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The nearest `f64`, or `None` if `token` is not a number. Takes `1.`, `.5`, `+1`, `1E-03`, `1d5`, `nan`, `-inf`
/// and what the C runtime of Windows prints for those (`1.#QNAN`).
pub(crate) fn parse_f64(token: &[u8]) -> Option<f64> {
    parse_short(token).or_else(|| parse_any(token))
}

/// Up to 19 digits and a small exponent: one exact product or quotient is then the correctly rounded result.
fn parse_short(token: &[u8]) -> Option<f64> {
    let (negative, digits) = split_sign(token);
    let (mut mantissa, mut count, mut exponent) = (0u64, 0usize, 0i32);
    let mut at = 0;
    while let Some(digit) = digit_at(digits, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    count += at;
    if digits.get(at) == Some(&b'.') {
        let first = at + 1;
        at = first;
        while let Some(digit) = digit_at(digits, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        count += at - first;
        exponent -= (at - first).min(64) as i32;
    }
    if count == 0 || count > 19 {
        return None;
    }
    if matches!(digits.get(at), Some(b'e' | b'E')) {
        let (below, power) = split_sign(&digits[at + 1..]);
        if power.is_empty() || power.len() > 3 {
            return None;
        }
        let power =
            power.iter().try_fold(0, |sum, c| c.is_ascii_digit().then(|| sum * 10 + i32::from(c - b'0')))?;
        exponent += if below { -power } else { power };
        at = digits.len();
    }
    if at != digits.len() || mantissa > 1 << 53 {
        return None;
    }
    let power = *POWERS_OF_TEN.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    Some(if negative { -value } else { value })
}

#[cold]
fn parse_any(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    text.parse().ok().or_else(|| {
        let unsigned = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        if let Some(name) = unsigned.strip_prefix("1.#") {
            let infinite = name.starts_with("inf");
            return Some(if infinite { f64::INFINITY.copysign(sign_of(text)) } else { f64::NAN });
        }
        if unsigned.starts_with("nan(") {
            return Some(f64::NAN);
        }
        // Fortran's exponents, and signs on the wrong side of the e.
        text.replace(['d', 'D', 'E'], "e").replace("+e", "e+").replace("-e", "e-").parse().ok()
    })
}

/// The integer, or `None` if `token` is not one or does not fit.
pub(crate) fn parse_i64(token: &[u8]) -> Option<i64> {
    let (negative, digits) = split_sign(token);
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let value =
        digits.iter().try_fold(0i64, |sum, c| c.is_ascii_digit().then(|| sum * 10 + i64::from(c - b'0')))?;
    Some(if negative { -value } else { value })
}

/// The words of a line, separated by any ASCII white space.
pub(crate) fn words(line: &[u8]) -> Words<'_> {
    Words(line)
}

/// See [`words`].
pub(crate) struct Words<'a>(&'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.0.iter().position(|&c| !is_space(c))?;
        let rest = &self.0[start..];
        let (word, rest) = rest.split_at(rest.iter().position(|&c| is_space(c)).unwrap_or(rest.len()));
        self.0 = rest;
        Some(word)
    }
}

/// Blank, tab, end of line, form feed, vertical tab.
pub(crate) fn is_space(c: u8) -> bool {
    c == b' ' || (b'\t'..=b'\r').contains(&c)
}

fn split_sign(token: &[u8]) -> (bool, &[u8]) {
    match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    }
}

fn digit_at(digits: &[u8], at: usize) -> Option<u64> {
    digits.get(at).filter(|c| c.is_ascii_digit()).map(|c| u64::from(c - b'0'))
}

fn sign_of(text: &str) -> f64 {
    if text.starts_with('-') { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_spellings_are_numbers() {
        for (text, value) in [
            ("1.", 1.0),
            (".5", 0.5),
            ("-.5", -0.5),
            ("+1", 1.0),
            ("1e5", 1e5),
            ("1.0E-03", 1e-3),
            ("1.0e+003", 1e3),
            ("1.5d2", 150.0),
            ("3.1+e2", 310.0),
            ("-3.1-E2", -0.031),
            ("0.1", 0.1),
            ("123456789012345678901234567890", 123456789012345678901234567890.0),
            ("1e-400", 0.0),
            ("2.2250738585072011e-308", f64::MIN_POSITIVE.next_down()),
            ("-inf", f64::NEG_INFINITY),
            ("-1.#INF", f64::NEG_INFINITY),
            ("Infinity", f64::INFINITY),
        ] {
            assert_eq!(parse_f64(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND"] {
            assert!(parse_f64(text.as_bytes()).is_some_and(f64::is_nan), "{text}");
        }
        for text in ["", "-", ".", "e5", "1e", "1x", "abc", "1.2.3", "0x10", "d", "1e5e5"] {
            assert_eq!(parse_f64(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn short_numbers_round_as_the_standard_library_does() {
        let mut seed = 1u64;
        for _ in 0..100_000 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let text = format!("{}.{}e{}", seed >> 50, (seed >> 20) & 0xffffff, (seed & 31) as i32 - 16);
            assert_eq!(parse_f64(text.as_bytes()), text.parse().ok(), "{text}");
        }
    }

    #[test]
    fn integers_never_overflow() {
        assert_eq!(parse_i64(b"-12"), Some(-12));
        assert_eq!(parse_i64(b"+7"), Some(7));
        for text in ["", "-", "1.0", "99999999999999999999", "1a"] {
            assert_eq!(parse_i64(text.as_bytes()), None, "{text}");
        }
    }
}
