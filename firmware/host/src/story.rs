//! Report of a device, in a form for people.

/// Prefix of lines that are about the device alone.
const ABOUT_THE_DEVICE: &str = "device: ";

/// Lines that the host has to report too.
pub fn shared(said: &str) -> impl Iterator<Item = &str> {
    said.lines().filter(|line| !line.starts_with(ABOUT_THE_DEVICE))
}

/// Prefixes of lines that are left out: single outputs, and details of events.
const LEFT_OUT: [&str; 2] = ["  output", "      "];

/// Lines with which a part of the mission begins.
const PARTS: [&str; 5] = [
    "first start",
    "second start",
    "interrupted flight",
    "spin",
    "temperature",
];

/// Prints the report in decimals.
pub fn tell(said: &str) {
    let told = |line: &&str| !LEFT_OUT.iter().any(|start| line.starts_with(start));
    for line in said.lines().filter(told) {
        if PARTS.contains(&line) {
            println!();
        }
        match line.strip_prefix(ABOUT_THE_DEVICE) {
            Some(about) => println!("[{about}]"),
            None => println!("{}", decimals(line)),
        }
    }
}

/// A line with decimals in place of the bits of numbers.
fn decimals(line: &str) -> String {
    let mut parts = line.split('#');
    let mut told = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.get(..8).and_then(|bits| u32::from_str_radix(bits, 16).ok()) {
            Some(bits) => told.push_str(&(decimal(f32::from_bits(bits)) + &part[8..])),
            None => told.push_str(&format!("#{part}")),
        }
    }
    told
}

/// Four digits.
fn decimal(number: f32) -> String {
    let size = number.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        format!("{number:.4}")
    } else {
        format!("{number:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::decimals;

    #[test]
    fn bits_become_decimals_and_words_stay() {
        assert_eq!(decimals("b #3f800000 #bf000000, 3"), "b 1.0000 -0.5000, 3");
        assert_eq!(decimals("sigma #7f800000 of #33d6bf95"), "sigma inf of 1.000e-7");
        assert_eq!(decimals("channel # 3"), "channel # 3");
    }
}
