//! The picture: the share of right joints against noise.

use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use crate::{Cell, Evaluation, EvaluationError, Measure, Row, RowResult, TYPES, rows::noise_and_sweep};

/// Name of the picture's row.
const NAME: &str = "picture";
/// Noise, millimetres.
const NOISES: [f64; 6] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
/// Sweeps, degrees: one panel each.
const SWEEPS: [f64; 4] = [10.0, 20.0, 45.0, 90.0];

/// Pixels.
const SIZE: (u32, u32) = (900, 720);
/// Height of title and legend, pixels.
const HEAD: u32 = 84;
const FONT: &str = "sans-serif";
/// One per column, different in lightness too.
const COLOURS: [RGBColor; 5] =
    [RGBColor(29, 78, 216), RGBColor(217, 119, 6), RGBColor(6, 95, 70), RGBColor(168, 85, 247), RGBColor(70, 70, 70)];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawing = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The row that the picture shows: eight types at every noise and sweep, scored by class.
pub fn picture() -> Row {
    let cell = |(sweep, noise): (f64, f64)| {
        Cell::new(format!("{sweep} deg, {noise} mm"), &TYPES, &noise_and_sweep(noise, sweep)).by(&[Measure::Classes])
    };
    let places = SWEEPS.into_iter().flat_map(|sweep| NOISES.map(|noise| (sweep, noise)));
    Row::new(NAME, "four classes against noise", places.map(cell).collect())
}

/// The picture of an evaluation of [`picture`]'s row, as SVG.
///
/// # Errors
/// [`EvaluationError::Picture`] if that row was not evaluated, or the picture cannot be drawn.
pub fn to_svg(evaluation: &Evaluation) -> Result<String, EvaluationError> {
    let Some(row) = evaluation.rows.iter().find(|row| row.name == NAME) else {
        return Err(EvaluationError::Picture { what: format!("the row `{NAME}` was not evaluated") });
    };
    let mut svg = String::new();
    let drawn = draw(&SVGBackend::with_string(&mut svg, SIZE).into_drawing_area(), evaluation, row);
    drawn.map_err(|error| EvaluationError::Picture { what: error.to_string() })?;
    Ok(svg)
}

fn draw(area: &Area<'_>, evaluation: &Evaluation, row: &RowResult) -> Drawing {
    area.fill(&WHITE)?;
    let (head, body) = area.split_vertically(HEAD);
    legend(&head, &evaluation.columns)?;
    for (index, (panel, sweep)) in body.split_evenly((2, 2)).iter().zip(SWEEPS).enumerate() {
        let cells = row.cells.iter().skip(index * NOISES.len()).take(NOISES.len());
        let share = |column: usize| {
            let scores = cells.clone().map(move |cell| cell.columns[column].scores.get(&Measure::Classes));
            NOISES.into_iter().zip(scores).filter_map(|(noise, score)| Some((noise, score?.value))).collect()
        };
        let lines: Vec<Vec<(f64, f64)>> = (0..evaluation.columns.len()).map(share).collect();
        draw_panel(panel, sweep, &lines)?;
    }
    area.present()
}

fn legend(head: &Area<'_>, columns: &[String]) -> Drawing {
    let title = (FONT, 24).into_font().color(&BLACK);
    head.draw_text("Joints found right, in four classes: rigid, prismatic, revolute, other", &title, (18, 12))?;
    let left = Pos::new(HPos::Left, VPos::Center);
    let mut x = 18;
    for (index, name) in columns.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        head.draw(&PathElement::new([(x, 60), (x + 34, 60)], colour.stroke_width(3)))?;
        head.draw(&Circle::new((x + 17, 60), 5, colour.filled()))?;
        let label = (FONT, 21).into_font().color(&BLACK).pos(left);
        head.draw_text(name, &label, (x + 44, 60))?;
        // Letters are about half as wide as high.
        x += 80 + 10 * i32::try_from(name.chars().count()).unwrap_or(0);
    }
    Ok(())
}

fn draw_panel(panel: &Area<'_>, sweep: f64, lines: &[Vec<(f64, f64)>]) -> Drawing {
    /// A little above 100 %, so that lines there are seen in full.
    const TOP: f64 = 105.0;
    let noises = (0.45..23.0).log_scale().with_key_points(NOISES.to_vec());
    let mut chart = ChartBuilder::on(panel)
        .margin(10)
        .margin_right(18)
        .caption(format!("sweep of {sweep} degrees"), (FONT, 21))
        .x_label_area_size(52)
        .y_label_area_size(66)
        .build_cartesian_2d(noises, 0.0..TOP)?;
    chart
        .configure_mesh()
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 225, 225))
        .x_label_formatter(&|noise: &f64| noise.to_string())
        .y_label_formatter(&|share: &f64| share.to_string())
        .x_desc("noise of a coordinate [mm]")
        .y_desc("right [%]")
        .label_style((FONT, 18))
        .axis_desc_style((FONT, 19))
        .draw()?;
    // The first column is drawn last, on top.
    for (index, line) in lines.iter().enumerate().rev() {
        let colour = COLOURS[index % COLOURS.len()];
        chart.draw_series(LineSeries::new(line.iter().copied(), colour.stroke_width(3)))?;
        chart.draw_series(line.iter().map(|&at| Circle::new(at, 4, colour.filled())))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Plan, evaluate, evaluation::tests::thesis};

    #[test]
    fn every_sweep_has_a_panel_with_a_line_of_every_column() {
        let mut row = picture();
        assert_eq!(row.cells.len(), SWEEPS.len() * NOISES.len());
        for condition in row.cells.iter_mut().flat_map(|cell| &mut cell.conditions) {
            (condition.options.frames, condition.options.features) = (Some(6), Some(4));
        }
        let plan = Plan { seeds: 1, first_seed: 1, threads: 1, times: true };
        let columns = [thesis("one"), thesis("<other>")];
        let svg = to_svg(&evaluate(&plan, &columns, &[row], &|_, _| ()).expect("scenes")).expect("a picture");
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        let count = |what: &str| svg.matches(what).count();
        assert_eq!(count("sweep of "), SWEEPS.len());
        assert_eq!(count("<circle"), 2 + 2 * SWEEPS.len() * NOISES.len(), "legend and values");
        assert!(svg.contains("&lt;other&gt;"), "names are escaped");
    }

    #[test]
    fn without_its_row_there_is_no_picture() {
        let nothing = Evaluation { seeds: 1, first_seed: 1, columns: vec![], rows: vec![] };
        assert!(matches!(to_svg(&nothing), Err(EvaluationError::Picture { .. })));
    }
}
