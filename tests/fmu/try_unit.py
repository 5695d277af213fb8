"""Tries an exported unit as an importer does, with FMPy: python try_unit.py VALVE.fmu. Ends with 0 where all holds."""

import math
import shutil
import sys
import tempfile
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

STEP = 1e-3
HALF_PITCH = math.pi / 50


class Valve:
    """One instance of the unit, in either version of the standard."""

    def __init__(self, folder, description, name):
        self.two = description.fmiVersion == "2.0"
        self.references = {of.name: of.valueReference for of in description.modelVariables}
        self.log = []
        self.unit = (FMU2Slave if self.two else FMU3Slave)(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.unit.instantiate()
        if self.two:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        self.steps = 0

    def set(self, name, value):
        (self.unit.setReal if self.two else self.unit.setFloat64)([self.references[name]], [value])

    def get(self, name):
        return (self.unit.getReal if self.two else self.unit.getFloat64)([self.references[name]])[0]

    def lost_steps(self):
        return (self.unit.getInteger if self.two else self.unit.getInt64)([self.references["lost_steps"]])[0]

    def step(self, command, size=STEP):
        self.set("command", command)
        self.unit.doStep(currentCommunicationPoint=self.steps * STEP, communicationStepSize=size)
        self.steps += 1
        return self.get("angle")

    def state(self):
        return (self.unit.getFMUstate if self.two else self.unit.getFMUState)()

    def restore(self, state):
        (self.unit.setFMUstate if self.two else self.unit.setFMUState)(state)

    def free(self, state):
        (self.unit.freeFMUstate if self.two else self.unit.freeFMUState)(state)

    def to_bytes(self, state):
        return (self.unit.serializeFMUstate if self.two else self.unit.serializeFMUState)(state)

    def of_bytes(self, data):
        return (self.unit.deSerializeFMUstate if self.two else self.unit.deserializeFMUState)(data)

    def end(self):
        self.unit.terminate()
        self.unit.freeInstance()


def ramp(valve, first, last):
    return [valve.step(1e-4 * (step + 1)) for step in range(first, last)]


def main():
    unit = Path(sys.argv[1])
    problems = validate_fmu(str(unit))
    assert not problems, problems
    result = fmpy.simulate_fmu(str(unit), stop_time=0.2, output=["angle", "friction_torque", "lost_steps"])
    assert len(result) > 100, result
    description = fmpy.read_model_description(str(unit))
    with tempfile.TemporaryDirectory() as place:
        # A folder that URIs have to encode.
        folder = Path(place) / "Prüfstand 1 %"
        fmpy.extract(str(unit), unzipdir=str(folder))
        first, second = Valve(folder, description, "first"), Valve(folder, description, "second")
        ramp(first, 0, 300)
        state = first.state()
        expected = ramp(first, 300, 600)
        # The rotor is held back by friction, and by no more than half a pitch of its teeth.
        assert 0.0 < expected[-1] < 0.06 + HALF_PITCH and expected[-1] > 0.06 - HALF_PITCH, expected[-1]
        assert first.lost_steps() == 0
        assert second.step(0.0) == 0.0, "the second instance moved with the first"
        data = first.to_bytes(state)
        for valve, kept in ((first, state), (second, second.of_bytes(data))):
            valve.restore(kept)
            assert ramp(valve, 300, 600) == expected, "a restored state goes on otherwise"
        first.free(state)
        # One long step is as many short ones.
        one, many = Valve(folder, description, "one"), Valve(folder, description, "many")
        many_angles = [many.step(0.001 * part) for part in (1, 2, 3, 4)]
        assert abs(one.step(0.004, 4 * STEP) - many_angles[-1]) < 1e-12
        # Refused numbers are an error of the call, and the unit goes on once they are mended.
        static = next((name for name in first.references if name.endswith("friction.static_torque_nm")), None)
        if static:
            good = second.get(static)
            second.set(static, -1.0)
            try:
                second.step(0.0)
                raise AssertionError("a negative friction was simulated")
            except fmpy.fmi1.FMICallException:
                pass
            second.set(static, good)
            second.step(0.0)
        for valve in (first, second, one, many):
            valve.end()
        # A model that was changed after the export is not simulated, and says so.
        model = folder / "resources" / "model.toml"
        model.write_text(model.read_text(encoding="utf-8").replace("holding_torque_nm", "holding_torque"), encoding="utf-8")
        try:
            Valve(folder, description, "bad")
            raise AssertionError("a bad model was instantiated")
        except Exception as error:  # FMPy raises a plain one.
            assert not isinstance(error, AssertionError), error
        shutil.rmtree(folder)
    print(f"{unit.name}: FMI {description.fmiVersion}, {len(description.modelVariables)} variables, all holds")


main()
