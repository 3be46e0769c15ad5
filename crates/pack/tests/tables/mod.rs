//! Reads the tables of FORMAT.md.

/// The document.
pub fn document() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/FORMAT.md")).unwrap()
}

/// Rows of the `nth` table below the heading that begins with `heading`, without its title row.
pub fn rows(doc: &str, heading: &str, nth: usize) -> Vec<Vec<String>> {
    let begins = |line: &&str| line.starts_with(heading);
    let below =
        doc.lines().skip_while(|line| !begins(line)).skip(1).take_while(|line| !line.starts_with('#'));
    let lines: Vec<&str> = below.collect();
    let tables: Vec<&[&str]> = lines
        .chunk_by(|a, b| a.starts_with('|') == b.starts_with('|'))
        .filter(|t| t[0].starts_with('|'))
        .collect();
    let cells = |line: &&str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_string()).collect();
    tables.get(nth).unwrap_or_else(|| panic!("no table {nth} below {heading}"))[2..]
        .iter()
        .map(cells)
        .collect()
}

/// Without the marks of code.
pub fn plain(cell: &str) -> String {
    cell.replace('`', "")
}
