"""Drives the simulated drive with SOEM (pysoem), an EtherCAT main device that is not ours: up to OP, enabled, some seconds of
cyclic synchronous position. Prints one line of JSON.

    tools/soem_check.py INTERFACE CYCLES
"""

import json
import struct
import sys
import time

import pysoem

CYCLE_S = 0.001


def main() -> int:
    interface, cycles = sys.argv[1], int(sys.argv[2])
    master = pysoem.Master()
    master.open(interface)
    try:
        print(json.dumps(drive(master, cycles)))
    finally:
        master.state = pysoem.INIT_STATE
        master.write_state()
        master.close()
    return 0


def drive(master, cycles):
    count = master.config_init()
    assert count == 1, f"{count} devices, expected 1"
    slave = master.slaves[0]
    seen = {"vendor": slave.man, "product": slave.id, "revision": slave.rev, "name": slave.name}
    # Segmented and expedited uploads, a download, an abort.
    seen["firmware"] = slave.sdo_read(0x100A, 0, 512).decode()
    seen["supported"] = struct.unpack("<I", slave.sdo_read(0x6502, 0))[0]
    try:
        slave.sdo_read(0x5FFF, 0)
        raise AssertionError("an object that is not there was read")
    except pysoem.SdoError as error:
        seen["abort"] = error.abort_code
    slave.sdo_write(0x6060, 0, struct.pack("<b", 8))
    slave.sdo_write(0x1C32, 1, struct.pack("<H", 2))
    slave.sdo_write(0x1C32, 2, struct.pack("<I", int(CYCLE_S * 1e9)))
    # SYNC0 has to run before SAFE-OP, which config_map asks for.
    master.config_dc()
    slave.dc_sync(True, int(CYCLE_S * 1e9))
    seen["map_size"] = master.config_map()
    assert master.state_check(pysoem.SAFEOP_STATE, 500_000) == pysoem.SAFEOP_STATE, slave.al_status
    cycle = Cycle(master, slave)
    for _ in range(50):
        cycle.run()
    master.state = pysoem.OP_STATE
    master.write_state()
    for _ in range(200):
        cycle.run()
    master.read_state()
    assert slave.state == pysoem.OP_STATE, (slave.state, slave.al_status)
    for control in (0x06, 0x07, 0x0F):
        cycle.control = control
        for _ in range(20):
            cycle.run()
    seen["status"] = cycle.status
    begin = cycle.position
    cycle.lost = 0
    for step in range(cycles):
        cycle.target = begin + step * 10
        cycle.run()
    for _ in range(200):
        cycle.run()
    trips = sorted(cycle.trips)
    seen |= {
        "lost": cycle.lost,
        "moved": cycle.position - begin,
        "end_status": cycle.status,
        "round_trip_p50_us": trips[len(trips) // 2] * 1e6,
        "round_trip_p99_us": trips[len(trips) * 99 // 100] * 1e6,
    }
    return seen


class Cycle:
    def __init__(self, master, slave):
        self.master, self.slave = master, slave
        self.control, self.target, self.lost, self.trips = 0, None, 0, []
        self.status, self.position, self.next = 0, 0, time.perf_counter()

    def run(self):
        target = self.position if self.target is None else self.target
        self.slave.output = struct.pack("<HibI", self.control, target, 8, 0)
        began = time.perf_counter()
        self.master.send_processdata()
        if self.master.receive_processdata(20_000) < self.master.expected_wkc:
            self.lost += 1
        else:
            self.status, self.position = struct.unpack_from("<Hi", self.slave.input)
            self.trips.append(time.perf_counter() - began)
        self.next = max(self.next + CYCLE_S, time.perf_counter() - CYCLE_S)
        time.sleep(max(0.0, self.next - time.perf_counter()))


if __name__ == "__main__":
    sys.exit(main())
