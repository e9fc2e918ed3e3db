//! Values of options, from their text.

use phiw_residual::trace::Thresholds;

/// A joint that is held and where \[rad, m\]: `JOINT` or `JOINT=VALUE`.
///
/// # Errors
/// There is no joint, or the value is no number.
pub fn held_joint(text: &str) -> Result<(String, f64), String> {
    let (joint, value) = text.split_once('=').unwrap_or((text, "0"));
    let joint = joint.trim();
    if joint.is_empty() {
        return Err("write JOINT or JOINT=VALUE".to_owned());
    }
    match value.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok((joint.to_owned(), number)),
        _ => Err(format!("`{value}` is not a position; write {joint} or {joint}=0.5 (rad or m)")),
    }
}

/// `LINK=KG`.
pub fn known_mass(text: &str) -> Result<(String, f64), String> {
    let Some((link, mass)) = text.split_once('=') else {
        return Err(format!("write LINK=KG, for example {text}=2.5"));
    };
    Ok((link.trim().to_owned(), positive(mass.trim())?))
}

/// `LINK=X Y Z A B C`: a centre, and half axes above zero.
pub fn inside(text: &str) -> Result<(String, [f64; 6]), String> {
    let wrong = || {
        format!(
            "`{text}` is not LINK=X Y Z A B C: centre and half axes of an ellipsoid (m), the latter above zero"
        )
    };
    let (link, numbers) = text.split_once('=').ok_or_else(wrong)?;
    let numbers: Vec<f64> =
        numbers.split_whitespace().map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    let numbers = <[f64; 6]>::try_from(numbers).map_err(|_| wrong())?;
    let is_fine =
        numbers.iter().all(|number| number.is_finite()) && numbers[3..].iter().all(|half| *half > 0.0);
    if is_fine { Ok((link.trim().to_owned(), numbers)) } else { Err(wrong()) }
}

/// `NAME=NAME`, two names that differ.
pub fn two_names(text: &str) -> Result<(String, String), String> {
    match text.split_once('=').map(|(one, other)| (one.trim(), other.trim())) {
        Some((one, other)) if one != other && !one.is_empty() && !other.is_empty() => {
            Ok((one.to_owned(), other.to_owned()))
        }
        _ => Err(format!("`{text}` is not LINK=LINK, two different links")),
    }
}

/// A number from 0 to 1.
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=1.0).contains(&number) => Ok(number),
        _ => Err(format!("`{text}` is not a number from 0 to 1")),
    }
}

/// `NAME=VALUE` of a threshold that there is.
pub fn threshold(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, for example least_share=0.3")?;
    let value = value.parse::<f64>().ok().filter(|value| value.is_finite() && *value >= 0.0);
    let value = value.ok_or_else(|| format!("`{text}` has no number from 0 on"))?;
    Thresholds::default().set(name, value).map_err(|error| error.to_string())?;
    Ok((name.to_owned(), value))
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err(format!("`{text}` is not a number above zero")),
    }
}

/// A word as a shell reads it back.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./,=:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A joint that is held, as `--hold` takes it.
pub fn held_in_words((joint, value): &(String, f64)) -> String {
    match *value {
        0.0 => joint.clone(),
        value => format!("{joint}={value}"),
    }
}
