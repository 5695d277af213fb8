//! A machine made of files: what `/proc`, `/sys` and `/dev` of one that suits the loop hold, changed file by file.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Folder and text of what a machine with a loop on core 1 of 2 shows when all is well.
const GOOD: [(&str, &str); 27] = [
    ("sys/kernel/realtime", "1\n"),
    ("proc/version", "Linux version 6.1.0-rt (Debian) #1 SMP PREEMPT_RT\n"),
    ("proc/timer_list", "cpu: 0\n  .hres_active    : 1\ncpu: 1\n  .hres_active    : 1\n"),
    ("proc/cmdline", "root=/dev/sda1 isolcpus=domain,managed_irq,1 nohz_full=1 -- isolcpus=0\n"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
    ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm\n"),
    ("sys/devices/system/cpu/online", "0-1\n"),
    ("sys/devices/system/cpu/isolated", "1\n"),
    ("sys/devices/system/cpu/nohz_full", "1\n"),
    ("sys/devices/system/cpu/smt/active", "0\n"),
    ("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state0/name", "POLL\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state0/latency", "0\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/name", "C6\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/latency", "133\n"),
    ("dev/cpu_dma_latency", ""),
    ("proc/irq/24/effective_affinity_list", "0\n"),
    ("proc/irq/24/eth0/.keep", ""),
    ("proc/interrupts", "           CPU0       CPU1\n 24:       1234         77  PCI-MSI  eth0\n"),
    ("proc/1/comm", "systemd\n"),
    ("proc/1/maps", "7f00-7f01 rw-s 00000000 00:1a 7 /dev/shm/other\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
    ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
    ("proc/self/limits", LIMITS),
    ("proc/self/status", "Name: x\nUid:\t995\t995\t995\t995\nCapEff:\t0000000000000000\n"),
    ("proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n"),
    ("proc/mounts", "tmpfs /dev/shm tmpfs rw 0 0\n"),
];
const LIMITS: &str = "Limit                     Soft Limit           Hard Limit           Units     \n\
    Max locked memory         unlimited            unlimited            bytes     \n\
    Max realtime priority     90                   90                             \n";

/// The machine.
pub struct FakeMachine {
    folder: PathBuf,
}

impl FakeMachine {
    /// One that suits the loop.
    ///
    /// # Panics
    /// Where its files can't be written.
    pub fn good(folder: PathBuf) -> Self {
        let machine = Self { folder };
        GOOD.iter().for_each(|(path, text)| machine.set(path, text));
        machine.set("proc/locks", "");
        let shared_memory = machine.path("dev/shm");
        std::fs::create_dir_all(&shared_memory).unwrap();
        std::fs::set_permissions(&shared_memory, std::fs::Permissions::from_mode(0o1777)).unwrap();
        machine
    }

    /// One that says nothing.
    ///
    /// # Panics
    /// Where its folder can't be made.
    pub fn mute(folder: PathBuf) -> Self {
        std::fs::create_dir_all(&folder).unwrap();
        Self { folder }
    }

    /// Its root folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A path in it.
    pub fn path(&self, path: &str) -> PathBuf {
        self.folder.join(path)
    }

    /// Gives a file another text.
    ///
    /// # Panics
    /// Where it can't be written.
    pub fn set(&self, path: &str, text: &str) {
        let path = self.path(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    /// Takes a file or folder away.
    ///
    /// # Panics
    /// Where it is not there.
    pub fn remove(&self, path: &str) {
        let path = self.path(path);
        if path.is_dir() {
            std::fs::remove_dir_all(path).unwrap()
        } else {
            std::fs::remove_file(path).unwrap()
        }
    }
}
