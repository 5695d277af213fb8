//! The view on the terminal.

use super::view::View;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline, Wrap};
use std::collections::VecDeque;
use supervisor::{ProcessStatus, Status};

/// An error of less than 0.02° fills no bar: at rest it is the encoder's step.
const LEAST_HEIGHT_RAD: f64 = 3.5e-4;

/// Draws all of it.
pub(super) fn draw(frame: &mut Frame, view: &View) {
    let Some(status) = &view.status else {
        let waiting = view.silent.as_deref().unwrap_or("waiting for the instance");
        frame.render_widget(Paragraph::new(waiting), frame.area());
        return;
    };
    let processes = status.processes.len() as u16 + 2;
    let areas: [Rect; 4] = Layout::vertical([
        Constraint::Length(9),
        Constraint::Length(4),
        Constraint::Length(processes),
        Constraint::Min(3),
    ])
    .areas(frame.area());
    let [valve, error, timing, events] = areas;
    let title = format!(" {}, generation {} ", status.instance, status.generation);
    let block = Block::bordered().title(title).title_bottom(" q ends the view, not the valve ");
    frame.render_widget(
        Paragraph::new(valve_lines(view, status)).wrap(Wrap { trim: false }).block(block),
        valve,
    );
    draw_error(frame, error, view, status);
    draw_processes(frame, timing, view, status);
    let shown = usize::from(events.height.saturating_sub(2));
    let skipped = view.events.len().saturating_sub(shown);
    let width = usize::from(events.width.saturating_sub(2));
    let newest = view.events.iter().skip(skipped);
    let lines: Vec<_> = newest.map(|entry| Line::from(cut(entry.to_string(), width))).collect();
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" events ")), events);
}

/// A text as far as there is room; what is missing of it is in `stepvalve events`.
fn cut(text: String, width: usize) -> String {
    if text.chars().count() <= width {
        return text;
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

fn state_style(status: &Status) -> Style {
    let color = match status.state.as_str() {
        "running" => Color::Green,
        "fault" | "silent" | "quick-stop" => Color::Red,
        "disarmed" => Color::Reset,
        _ => Color::Yellow,
    };
    Style::new().fg(color).add_modifier(Modifier::BOLD)
}

fn valve_lines<'a>(view: &'a View, status: &'a Status) -> Vec<Line<'a>> {
    let state = match &view.silent {
        Some(why) => Span::styled(format!("NO ANSWER: {why}"), Style::new().fg(Color::Red).bold()),
        None => Span::styled(status.state_words(), state_style(status)),
    };
    let homed = if status.homed { "" } else { "  NOT HOMED" };
    let limiting = if status.limiting { "  held back by a limit" } else { "" };
    vec![
        Line::from(vec!["state      ".into(), state]),
        Line::from(format!("set-point  {}", status.set_point_words())),
        Line::from(format!("angle      {:.3}°{homed}", status.angle_rad.to_degrees())),
        Line::from(format!(
            "reserve    {:.2} N·m{limiting}   pulse rate {:.1} kHz   oil {:.2} MPa, {:.1} °C",
            status.torque_reserve_nm,
            status.pulse_rate_hz / 1e3,
            status.pressure_drop_pa / 1e6,
            status.oil_temperature_c
        )),
        Line::from(status.alarms.join("; ")).fg(Color::Red),
        Line::from(status.fault_advice.as_str()),
    ]
}

fn draw_error(frame: &mut Frame, area: Rect, view: &View, status: &Status) {
    let full = view.errors_rad.iter().copied().fold(LEAST_HEIGHT_RAD, f64::max);
    let title = format!(
        " following error {:.4}°, peak since arming {:.4}°, full height {:.4}° ",
        status.following_error_rad.to_degrees(),
        status.following_error_peak_rad.to_degrees(),
        full.to_degrees()
    );
    let block = Block::bordered().title(title);
    let inner = block.inner(area);
    frame.render_widget(block, area);
    frame.render_widget(sparkline(&view.errors_rad, usize::from(inner.width), full), inner);
}

fn draw_processes(frame: &mut Frame, area: Rect, view: &View, status: &Status) {
    let block = Block::bordered()
        .title(" processes: overruns, skipped, missed; largest wake-up latency in a second ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    for (row, (name, process)) in status.processes.iter().enumerate().take(usize::from(inner.height)) {
        let line = Rect { y: inner.y + row as u16, height: 1, ..inner };
        let [words, history] = Layout::horizontal([Constraint::Length(62), Constraint::Min(4)]).areas(line);
        frame.render_widget(process_line(name, process), words);
        if let Some(latencies) = view.latencies_us.get(name) {
            frame.render_widget(sparkline(latencies, usize::from(history.width), 0.0), history);
        }
    }
}

fn process_line(name: &str, process: &ProcessStatus) -> Line<'static> {
    let ProcessStatus { overruns, skipped_cycles, missed_samples, wake_up_latency_us, .. } = process;
    let text = format!(
        "{name:<20} {overruns:>6} {skipped_cycles:>6} {missed_samples:>6} {wake_up_latency_us:>9.0} µs "
    );
    match (process.silent, process.late) {
        (true, _) => Line::from(format!("{text} SILENT")).fg(Color::Red),
        (false, true) => Line::from(format!("{text} late")).fg(Color::Yellow),
        (false, false) => Line::from(text),
    }
}

/// Bars of the newest values that fit; the highest stands for the largest of them, or for `full` where that is more.
fn sparkline(history: &VecDeque<f64>, width: usize, full: f64) -> Sparkline<'static> {
    let skipped = history.len().saturating_sub(width);
    let shown: Vec<f64> = history.iter().skip(skipped).copied().collect();
    let largest = shown.iter().copied().fold(full.max(f64::MIN_POSITIVE), f64::max);
    Sparkline::default().data(shown.into_iter().map(move |value| (value / largest * 1e3) as u64)).max(1000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn screen(view: &View) -> String {
        let mut terminal = Terminal::new(TestBackend::new(110, 24)).unwrap();
        terminal.draw(|frame| draw(frame, view)).unwrap();
        terminal.backend().to_string()
    }

    fn status() -> Status {
        let process = ProcessStatus { overruns: 3, wake_up_latency_us: 57.0, ..ProcessStatus::default() };
        Status {
            instance: "bench".to_owned(),
            state: "running".to_owned(),
            fault: "none".to_owned(),
            homed: true,
            angle_rad: 0.3,
            processes: [("step-controller".to_owned(), process)].into(),
            ..Status::default()
        }
    }

    #[test]
    fn it_shows_what_an_operator_looks_for() {
        let mut view = View::default();
        assert!(screen(&view).contains("waiting for the instance"));
        view.take(status());
        let shown = screen(&view);
        for expected in ["bench, generation", "running", "17.189°", "step-controller", "57 µs"] {
            assert!(shown.contains(expected), "{expected} is missing:\n{shown}");
        }
    }

    #[test]
    fn an_instance_that_does_not_answer_is_not_shown_as_running() {
        let mut view = View::default();
        view.take(status());
        view.unanswered("gone".to_owned());
        let shown = screen(&view);
        assert!(shown.contains("NO ANSWER: gone") && !shown.contains("running"), "{shown}");
    }

    #[test]
    fn a_controller_that_hangs_is_named() {
        let mut view = View::default();
        let hung = Status {
            state: "silent".to_owned(),
            last_state: "running".to_owned(),
            controller_silent_s: 0.3,
            ..status()
        };
        view.take(hung);
        let shown = screen(&view);
        assert!(shown.contains("UNKNOWN: the controller has said nothing for 0.3 s"), "{shown}");
    }
}
