//! How the verdict about a pair came about, for people.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use jointscope_detection::{Account, Explanation, ModelFinding, PairDetection, Quantity};

use crate::printable;

/// What the models found about a pair, the arithmetic of the rule, and why the winner won.
///
/// *Convention.* Metres and radians, where names do not say otherwise; costs in units of -2 log likelihood.
pub fn to_explanation(pair: &PairDetection) -> String {
    let [reference, moving, joint] = [&pair.reference, &pair.moving, &pair.verdict.joint].map(|name| printable(name));
    let doubt = if pair.determined { "determined" } else { "not determined" };
    let mut text = format!("{reference} - {moving}: {joint}, {doubt}\n");
    if !pair.models.is_empty() {
        text += "\nWhat the models found, each by itself\n\n";
        text += &findings(pair);
    }
    if let Some(explanation) = &pair.explanation {
        text += &arithmetic(explanation);
    }
    if !pair.notes.is_empty() {
        text += "\nNotes\n\n";
        text.extend(pair.notes.iter().map(|note| format!("  {}\n", printable(note))));
    }
    text
}

fn findings(pair: &PairDetection) -> String {
    let mut table = plain();
    table.set_header(["model", "confidence", "residual [m]", "parts"]);
    for (name, finding) in &pair.models {
        table.add_row([vec![printable(name)], cells(finding)].concat());
    }
    right(&mut table, 1..3);
    lines(&table)
}

fn cells(finding: &ModelFinding) -> Vec<String> {
    match finding {
        Ok(fit) => {
            let parts: Vec<String> =
                fit.parts.iter().map(|(part, value)| format!("{part} {}", number(*value))).collect();
            let residual = fit.residual_rms.map_or_else(|| "-".to_owned(), number);
            vec![number(fit.confidence.value()), residual, parts.join(", ")]
        }
        Err(error) => vec!["-".into(), "-".into(), printable(&error.to_string())],
    }
}

fn arithmetic(explanation: &Explanation) -> String {
    let Explanation { rule, quantities, accounts, reasons, by_evidence } = explanation;
    let mut text = String::new();
    if let Some(by_evidence) = by_evidence {
        text += "\nThe evidence, by the rule \"likelihood\"\n";
        text += &steps(&by_evidence.quantities, &by_evidence.accounts);
    }
    text.extend(["\nThe rule \"", rule.word(), "\"\n"]);
    if !accounts.is_empty() {
        text += &steps(quantities, accounts);
    }
    text += "\nWhy\n\n";
    text.extend(reasons.iter().map(|reason| format!("  {}\n", printable(reason))));
    text
}

fn steps(quantities: &[Quantity], accounts: &[Account]) -> String {
    let mut table = plain();
    let joints = accounts.iter().map(|account| printable(&account.joint));
    table.set_header([String::new()].into_iter().chain(joints));
    for (index, quantity) in quantities.iter().enumerate() {
        let values = accounts.iter().map(|account| account.values[index].map_or_else(|| "-".into(), number));
        table.add_row([quantity.name.to_owned()].into_iter().chain(values));
    }
    right(&mut table, 1..accounts.len() + 1);
    let mut text = format!("\n{}\n", lines(&table));
    let width = quantities.iter().map(|quantity| quantity.name.len()).max().unwrap_or(0);
    text.extend(quantities.iter().map(|quantity| format!("  {:<width$}  {}\n", quantity.name, quantity.meaning)));
    text += "\nStep by step\n\n";
    let width = accounts.iter().map(|account| account.joint.chars().count()).max().unwrap_or(0);
    let steps = accounts.iter().map(|account| (printable(&account.joint), printable(&account.arithmetic)));
    text.extend(steps.map(|(joint, arithmetic)| format!("  {joint:<width$}  {arithmetic}\n")));
    text
}

fn plain() -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table
}

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for index in columns {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

fn lines(table: &Table) -> String {
    table.lines().fold(String::new(), |text, line| text + " " + line.trim_end() + "\n")
}

/// A number with three decimals, or as a power of ten where they would not show it.
fn number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-3..1e7).contains(&x.abs());
    if plain { format!("{:.3}", x + 0.0) } else { format!("{x:.2e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_show_what_they_are() {
        assert_eq!([0.0, -0.0, 1.0, 2e-9, 1e9].map(number), ["0.000", "0.000", "1.000", "2.00e-9", "1.00e9"]);
        assert_eq!(number(f64::INFINITY), "inf");
    }
}
