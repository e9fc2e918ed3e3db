//! Every picture is well-formed whatever it is given, and shows what it should.

use phiw_report::plot::*;

/// The numbers that a robot's log can hold on a bad day.
fn awkward() -> Vec<(&'static str, Vec<f64>, Vec<f64>)> {
    let many: Vec<f64> = (0..20_000).map(f64::from).collect();
    let wave: Vec<f64> = many.iter().map(|x| (x / 300.0).sin()).collect();
    vec![
        ("empty", vec![], vec![]),
        ("one point", vec![1.0], vec![2.0]),
        ("constant", vec![0.0, 1.0, 2.0], vec![5.0; 3]),
        ("all zero", vec![0.0; 3], vec![0.0; 3]),
        ("all NaN", vec![f64::NAN; 4], vec![f64::NAN; 4]),
        ("gaps", vec![0.0, 1.0, 2.0, 3.0], vec![1.0, f64::NAN, 2.0, f64::NAN]),
        ("infinite", vec![0.0, 1.0, f64::INFINITY], vec![f64::NEG_INFINITY, 1.0, 2.0]),
        ("huge", vec![-1e99, 0.0, 1e99], vec![1e279, -1e100, f64::MAX]),
        ("tiny", vec![0.0, 1e-300, 2e-300], vec![5e-324, -5e-324, 0.0]),
        ("unequal", vec![0.0, 1.0, 2.0], vec![1.0]),
        ("offset", vec![1e9, 1e9 + 1.0], vec![1e9, 1e9 + 1e-6]),
        ("long", many, wave),
    ]
}

/// Each kind of picture of the same awkward numbers.
fn pictures(x: &[f64], y: &[f64]) -> Vec<(&'static str, Svg)> {
    let line = Line { x, y };
    let name = "<torso/joint_1> & \"co\" \u{1}";
    let floor = y.first().copied();
    let groups: Vec<_> = y
        .iter()
        .take(18)
        .map(|&v| BarGroup { joint: name.into(), before: Some(v), after: None, noise_floor: Some(v) })
        .collect();
    let places = [name.to_string(), "2".into()];
    let samples = [x.to_vec(), y.to_vec()];
    let boxes = [BoxGroup { name, samples: &samples }, BoxGroup { name: "b", samples: &samples[..1] }];
    let lines = [IterationLine { name, values: y }, IterationLine { name: "b", values: x }];
    let spectra = [SpectrumLine { name, line }];
    let mut all = vec![
        ("torque", torque_panel(&TorquePanel { measured: line, predicted: line, unit: name })),
        (
            "residual",
            residual_panel(&ResidualPanel { residual: line, torque: line, noise_floor: floor, unit: name }),
        ),
        ("signal", signal_panel(&SignalPanel { line, label: name })),
        ("bars", joint_bars(&JointBars { groups: &groups, label: name })),
        ("spectrum", spectrum(&SpectrumPlot { lines: &spectra, y_label: name, cut_off: floor })),
        (
            "error growth",
            error_growth(&ErrorGrowth { lines: &[GrowthLine { name, line }], x_label: name, y_label: name }),
        ),
    ];
    for after in [line, Line::default()] {
        let input = ResidualAgainstSignal { signal: name, residual: name, before: line, after };
        all.push(("residual against signal", residual_against_signal(&input)));
    }
    for logarithmic in [false, true] {
        let input = BoxPlot { groups: &boxes, places: &places, x_label: name, y_label: name, logarithmic };
        all.push(("box plot", box_plot(&input)));
        let input = Iterations { lines: &lines, x_label: name, y_label: name, first: 1, logarithmic };
        all.push(("iterations", iterations(&input)));
    }
    all
}

#[test]
fn every_picture_is_well_formed_and_within_its_frame() {
    for (case, x, y) in awkward() {
        for (kind, svg) in pictures(&x, &y) {
            let text = svg.as_str();
            let document = roxmltree::Document::parse(text).unwrap_or_else(|e| panic!("{kind}, {case}: {e}"));
            assert!(!text.contains("NaN") && !text.contains("inf"), "{kind}, {case}: a number that is none");
            assert!(text.len() < 150_000, "{kind}, {case}: {} bytes", text.len());
            let size: Vec<f64> = document
                .root_element()
                .attribute("viewBox")
                .unwrap()
                .split(' ')
                .map(|number| number.parse().unwrap())
                .collect();
            for (x, y) in document.descendants().filter_map(|node| node.attribute("d")).flat_map(starts) {
                assert!(x >= 0.0 && x <= size[2] && y >= 0.0 && y <= size[3], "{kind}, {case}: {x}, {y}");
            }
        }
    }
}

/// Where the subpaths of a path begin.
fn starts(data: &str) -> Vec<(f64, f64)> {
    data.split('M')
        .skip(1)
        .map(|subpath| {
            let (x, rest) = subpath.split_once(' ').unwrap();
            let y: String = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '-').collect();
            (x.parse().unwrap(), y.parse().unwrap())
        })
        .collect()
}

#[test]
fn a_line_breaks_at_a_gap() {
    let subpaths = |y: &[f64]| {
        let line = Line { x: &[0.0, 1.0, 2.0, 3.0, 4.0], y };
        let svg =
            residual_panel(&ResidualPanel { residual: line, torque: line, noise_floor: None, unit: "N·m" })
                .to_string();
        let path = svg.lines().rfind(|line| line.starts_with("<path")).unwrap().to_string();
        path.matches('M').count()
    };
    assert_eq!(subpaths(&[0.0, 1.0, 2.0, 1.0, 0.0]), 1);
    assert_eq!(subpaths(&[0.0, 1.0, f64::NAN, 1.0, 0.0]), 2);
}

#[test]
fn words_are_escaped() {
    for (kind, svg) in pictures(&[0.0, 1.0], &[0.0, 1.0]) {
        assert!(!svg.as_str().contains("<torso"), "{kind}");
    }
}
