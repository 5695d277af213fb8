//! One unit: a valve that its importer sets, steps and reads.

use crate::variables::{
    COMMAND, CURRENT, INPUTS, LOST_STEPS, NUMBERS, PRESSURE, START_ANGLE, TEMPERATURE, TIME, output,
};
use crate::{Causality, Kind, MODEL_FILE, Snapshot, UnitError, Variables};
use config::{Editable, ModelComments, Setting, parse_model, write_model};
use valve_model::{Model, MotorParams, ValveInput, ValveParams, ValveState, step};

/// The longest cycle that a communication step is made of, s: that of the loop.
const CYCLE_S: f64 = 1e-3;
/// A communication step is so many cycles long where it exceeds that by no more than rounding.
const ROUNDING: f64 = 1e-9;
/// The longest communication step, s.
const LONGEST_S: f64 = 10.0;

/// A valve.
///
/// ```
/// let mut unit = fmu::Unit::new(&std::fs::read_to_string("../../rt-config/models/rig.toml")?)?;
/// unit.begin()?;
/// for cycle in 1..=1000 {
///     unit.set_real(0, 1e-4 * f64::from(cycle))?; // the command, rad
///     unit.step(1e-3)?;
/// }
/// // Friction of 1.5 N·m holds the rotor back, of a motor that holds 6 N·m and has 50 teeth.
/// let lag_rad = 0.1 - unit.real(10)?;
/// assert!((lag_rad - f64::asin(1.5 / 6.0) / 50.0).abs() < 1e-4, "{lag_rad}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Unit {
    text: Editable,
    variables: Variables,
    params: ValveParams,
    motor: MotorParams,
    /// The model's numbers that `params` and `motor` were made of.
    simulated: Vec<f64>,
    now: Snapshot,
}

impl Unit {
    /// A valve at rest, of a model's text.
    ///
    /// # Errors
    /// A text that is no model of a whole valve.
    pub fn new(text: &str) -> Result<Self, UnitError> {
        let model = model_of(text)?;
        let text = Editable::new(&canonical(&model))
            .ok_or_else(|| UnitError::Model("the model can't be written as text".to_owned()))?;
        let variables = Variables::new(&model, &text);
        let (params, motor) = prepared(&model)?;
        let numbers: Vec<f64> =
            variables.iter().filter(|of| of.path.is_some()).filter_map(|of| of.start).collect();
        let simulated = numbers.clone();
        let now = Snapshot {
            valve: ValveState::at_rest(0.0),
            inputs: [COMMAND, PRESSURE, TEMPERATURE, CURRENT]
                .map(|input| variables.get(input).and_then(|of| of.start).unwrap_or(0.0)),
            command_rad: 0.0,
            output: None,
            start_angle_rad: 0.0,
            lost_at_start: 0,
            time_s: 0.0,
            runs: false,
            numbers,
        };
        Ok(Self { text, variables, params, motor, simulated, now })
    }

    /// Its variables.
    pub fn variables(&self) -> &Variables {
        &self.variables
    }

    /// Ends the initialisation: the valve rests at its start angle, the command where the input says.
    ///
    /// # Errors
    /// Numbers of the model that it forbids.
    pub fn begin(&mut self) -> Result<(), UnitError> {
        self.take_numbers()?;
        self.now.valve = ValveState::at_rest(self.now.start_angle_rad);
        self.now.command_rad = self.input(COMMAND);
        self.now.lost_at_start = self.lost_steps();
        self.now.output = None;
        self.now.runs = true;
        Ok(())
    }

    /// Moves by a communication step, the command at a constant speed to its input.
    ///
    /// # Errors
    /// A step that is too long or none; numbers of the model that it forbids; inputs that lead nowhere.
    pub fn step(&mut self, step_s: f64) -> Result<(), UnitError> {
        if !(step_s > 0.0 && step_s <= LONGEST_S) {
            return Err(UnitError::Step(step_s));
        }
        self.take_numbers()?;
        let cycles = (step_s / CYCLE_S - ROUNDING).ceil().max(1.0);
        let (from_rad, to_rad) = (self.now.command_rad, self.input(COMMAND));
        let along = |part: f64| if part < 1.0 { from_rad + part * (to_rad - from_rad) } else { to_rad };
        let mut valve = self.now.valve;
        let mut last = self.now.output;
        for cycle in 0..cycles as u32 {
            let cycle = f64::from(cycle);
            let input = ValveInput {
                command_start_rad: along(cycle / cycles),
                command_end_rad: along((cycle + 1.0) / cycles),
                pressure_drop_pa: self.input(PRESSURE),
                oil_temperature_c: self.input(TEMPERATURE),
                current_ratio: self.input(CURRENT),
            };
            last = Some(step(&self.params, &mut valve, &input, step_s / cycles));
        }
        if !(valve.angle_rad.is_finite() && valve.speed_rad_per_s.is_finite()) {
            return Err(UnitError::NotFinite(self.now.time_s + step_s));
        }
        self.now.valve = valve;
        self.now.output = last;
        self.now.command_rad = to_rad;
        self.now.time_s += step_s;
        Ok(())
    }

    /// How far it was stepped since it began, s.
    pub fn time_s(&self) -> f64 {
        self.now.time_s
    }

    /// A number.
    ///
    /// # Errors
    /// [`UnitError::Unknown`].
    pub fn real(&self, reference: u32) -> Result<f64, UnitError> {
        self.known(reference, Kind::Real)?;
        match reference {
            START_ANGLE => Ok(self.now.start_angle_rad),
            input if (input as usize) < INPUTS => Ok(self.input(input)),
            number if number >= NUMBERS => self.number(number).ok_or(UnitError::Unknown(number)),
            other => {
                let value = output(other, &self.now.valve, self.now.output.as_ref());
                value.ok_or(UnitError::Unknown(other))
            }
        }
    }

    /// A number, or the time, which is a variable of FMI 3.0.
    ///
    /// # Errors
    /// [`UnitError::Unknown`].
    pub fn number_or_time(&self, reference: u32) -> Result<f64, UnitError> {
        if reference == TIME { Ok(self.now.time_s) } else { self.real(reference) }
    }

    /// A whole number.
    ///
    /// # Errors
    /// [`UnitError::Unknown`].
    pub fn integer(&self, reference: u32) -> Result<i64, UnitError> {
        self.known(reference, Kind::Integer)?;
        match reference {
            LOST_STEPS => Ok(self.lost_steps() - self.now.lost_at_start),
            other => Err(UnitError::Unknown(other)),
        }
    }

    /// Sets an input or a parameter. A number of the model is checked at the next step, with all others: a static friction may be
    /// below the Coulomb friction until that is set, too.
    ///
    /// # Errors
    /// A variable that is computed, or fixed by now; no finite number.
    pub fn set_real(&mut self, reference: u32, value: f64) -> Result<(), UnitError> {
        let variable = self.known(reference, Kind::Real)?;
        let (name, causality) = (variable.name.clone(), variable.causality);
        if !value.is_finite() {
            return Err(UnitError::NoNumber { name, value });
        }
        match causality {
            Causality::Output => return Err(UnitError::Computed(name)),
            Causality::Fixed if self.now.runs => return Err(UnitError::Fixed(name)),
            Causality::Fixed => {
                self.now.start_angle_rad = value;
                self.now.valve = ValveState::at_rest(value);
            }
            Causality::Input => {
                if let Some(place) = self.now.inputs.get_mut(reference as usize) {
                    *place = value;
                }
            }
            Causality::Tunable => {
                let place = self.now.numbers.get_mut((reference - NUMBERS) as usize);
                let place = place.ok_or(UnitError::Unknown(reference))?;
                *place = value;
            }
        }
        Ok(())
    }

    /// Its state.
    pub fn snapshot(&self) -> Snapshot {
        self.now.clone()
    }

    /// Takes a state of this unit, or of another of the same model.
    ///
    /// # Errors
    /// [`UnitError::State`] of another model's.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), UnitError> {
        if snapshot.numbers.len() != self.now.numbers.len() {
            return Err(UnitError::State);
        }
        self.now = snapshot.clone();
        Ok(())
    }

    fn known(&self, reference: u32, kind: Kind) -> Result<&crate::Variable, UnitError> {
        self.variables.get(reference).filter(|of| of.kind == kind).ok_or(UnitError::Unknown(reference))
    }

    fn input(&self, reference: u32) -> f64 {
        self.now.inputs.get(reference as usize).copied().unwrap_or(0.0)
    }

    fn number(&self, reference: u32) -> Option<f64> {
        self.now.numbers.get(reference.checked_sub(NUMBERS)? as usize).copied()
    }

    fn lost_steps(&self) -> i64 {
        self.motor.lost_steps(self.now.command_rad, self.now.valve.angle_rad)
    }

    /// Puts the numbers that were set into the model that is simulated.
    fn take_numbers(&mut self) -> Result<(), UnitError> {
        if self.simulated == self.now.numbers {
            return Ok(());
        }
        let numbers = self.variables.iter().filter_map(|of| of.path.as_deref()).zip(&self.now.numbers);
        let settings: Vec<(&str, Setting)> = numbers
            .map(|(path, number)| (path, Setting::Number { number: *number, unit: String::new() }))
            .collect();
        let changes = settings.iter().map(|(path, setting)| (*path, setting));
        let text = self.text.with(changes).ok_or(UnitError::State)?;
        (self.params, self.motor) = prepared(&model_of(&text)?)?;
        self.simulated.clone_from(&self.now.numbers);
        Ok(())
    }
}

pub(crate) fn model_of(text: &str) -> Result<Model, UnitError> {
    parse_model(text, MODEL_FILE).map_err(|errors| UnitError::Model(errors.to_string()))
}

/// A model's text in SI units, without comments: what its numbers are found in.
pub(crate) fn canonical(model: &Model) -> String {
    write_model(model, &ModelComments::default())
}

fn prepared(model: &Model) -> Result<(ValveParams, MotorParams), UnitError> {
    let params = ValveParams::new(model)?;
    let motor = model.motor.ok_or_else(|| UnitError::Model("the model has no [motor]".to_owned()))?;
    Ok((params, motor))
}
