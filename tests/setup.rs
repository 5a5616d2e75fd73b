//! `scripts/setup.sh` on machines with missing programs, simulated by a folder in place of `/` and
//! programs that do nothing.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A machine with Rust and a linker, but without Vulkan.
struct Machine {
    root: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

/// A program cannot be started while any process holds it open for writing. A process that another
/// thread starts briefly holds open the files that this one is writing.
static TURN: Mutex<()> = Mutex::new(());

impl Machine {
    fn empty() -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let machine = Self { root: tempfile::tempdir().unwrap(), _turn: turn };
        machine.program("cargo", "");
        machine.program("rustc", "echo rustc 1.99.0");
        machine.program("cc", "");
        machine.program("id", "echo 0");
        // The tools that the script itself uses are the real ones.
        for tool in ["sh", "sed", "uname", "mktemp", "rm", "dirname"] {
            let found =
                ["/usr/bin", "/bin"].iter().map(|folder| Path::new(folder).join(tool)).find(|p| p.exists());
            symlink(found.unwrap(), machine.path("bin").join(tool)).unwrap();
        }
        machine
    }

    fn path(&self, relative: &str) -> PathBuf {
        self.root.path().join(relative)
    }

    fn file(&self, relative: &str) {
        let path = self.path(relative);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "{}").unwrap();
    }

    fn program(&self, name: &str, body: &str) {
        let path = self.path("bin").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
        fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
    }

    fn complete(&self) {
        self.file("usr/lib/libvulkan.so.1");
        self.file("usr/share/vulkan/icd.d/lvp_icd.x86_64.json");
        self.file("usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json");
        for library in ["libX11-xcb.so.1", "libXcursor.so.1", "libXi.so.6", "libxkbcommon-x11.so.0"] {
            self.file(&format!("usr/lib/x86_64-linux-gnu/{library}"));
        }
        self.program("Xvfb", "");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new("/bin/sh");
        command
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/setup.sh"))
            .args(arguments)
            .env_clear()
            .env("PATH", self.path("bin"))
            .env("HOME", self.path("home"))
            .env("SETUP_ROOT", self.root.path())
            .env("SETUP_DRY_RUN", "1");
        command
    }

    fn run(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        outcome(self.command(arguments).output().unwrap())
    }
}

fn outcome(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_complete_machine_is_left_alone_in_silence() {
    let machine = Machine::empty();
    machine.complete();
    for arguments in [&[][..], &["--tests"]] {
        assert_eq!(machine.run(arguments), (Some(0), String::new(), String::new()));
    }
}

#[test]
fn each_package_manager_gets_its_own_packages() {
    let machine = Machine::empty();
    machine.program("cc", "exit 1");
    for (manager, expected) in [
        (
            "apt-get",
            "gcc libc6-dev libvulkan1 mesa-vulkan-drivers vulkan-validationlayers \
             libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 xvfb",
        ),
        (
            "dnf",
            "dnf install -y gcc glibc-devel vulkan-loader mesa-vulkan-drivers vulkan-validation-layers \
             libX11-xcb libXcursor libXi libxkbcommon-x11 xorg-x11-server-Xvfb",
        ),
        (
            "pacman",
            "pacman -Sy --needed --noconfirm gcc vulkan-icd-loader vulkan-swrast vulkan-validation-layers \
             libx11 libxcursor libxi libxkbcommon-x11 xorg-server-xvfb",
        ),
        (
            "zypper",
            "zypper --non-interactive install gcc glibc-devel libvulkan1 libvulkan_lvp vulkan-validationlayers \
             libX11-xcb1 libXcursor1 libXi6 libxkbcommon-x11-0 xorg-x11-server-Xvfb",
        ),
        (
            "apk",
            "apk add gcc musl-dev vulkan-loader mesa-vulkan-swrast vulkan-validation-layers \
             libx11 libxcursor libxi libxkbcommon-x11 xvfb",
        ),
        ("brew", "brew install gcc vulkan-loader molten-vk vulkan-validationlayers"),
    ] {
        let (code, out, _) =
            outcome(machine.command(&["--tests"]).env("SETUP_MANAGER", manager).output().unwrap());
        assert_eq!(code, Some(0));
        assert!(out.trim_end().ends_with(expected), "{out}");
    }
}

#[test]
fn only_what_is_missing_is_installed() {
    let machine = Machine::empty();
    machine.complete();
    machine.program("apt-get", "");
    fs::remove_file(machine.path("usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json"))
        .unwrap();
    assert_eq!(machine.run(&[]).1, "");
    let (_, out, err) = machine.run(&["--tests"]);
    assert!(out.starts_with("sh -c apt-get update && "), "{out}");
    assert!(out.trim_end().ends_with("--no-install-recommends vulkan-validationlayers"), "{out}");
    assert_eq!(err, "setup: missing: layers\n");
    fs::remove_file(machine.path("bin/Xvfb")).unwrap();
    assert_eq!(machine.run(&["--tests"]).2, "setup: missing: layers display\n");
    fs::remove_file(machine.path("usr/lib/x86_64-linux-gnu/libXi.so.6")).unwrap();
    assert_eq!(machine.run(&["--tests"]).2, "setup: missing: layers xlib display\n");
    assert_eq!(machine.run(&[]), (Some(0), String::new(), String::new()));
}

#[test]
fn python_is_installed_where_it_is_asked_for() {
    let machine = Machine::empty();
    machine.complete();
    assert_eq!(machine.run(&[]), (Some(0), String::new(), String::new()));
    // A Python without the modules of virtual environments.
    machine.program("python3", "exit 1");
    for (manager, expected) in [
        ("apt-get", "python3 python3-venv"),
        ("dnf", "python3 python3-pip"),
        ("pacman", "python"),
        ("zypper", "python3 python3-pip"),
        ("apk", "python3 py3-pip"),
        ("brew", "brew install python"),
    ] {
        let (code, out, err) =
            outcome(machine.command(&["--python"]).env("SETUP_MANAGER", manager).output().unwrap());
        assert_eq!((code, err.as_str()), (Some(0), "setup: missing: python\n"));
        assert!(out.trim_end().ends_with(expected), "{out}");
    }
    machine.program("python3", "");
    assert_eq!(machine.run(&["--python"]), (Some(0), String::new(), String::new()));
}

#[test]
fn a_driver_for_absent_hardware_does_not_count() {
    let machine = Machine::empty();
    machine.complete();
    machine.program("apt-get", "");
    fs::remove_file(machine.path("usr/share/vulkan/icd.d/lvp_icd.x86_64.json")).unwrap();
    machine.file("etc/vulkan/icd.d/nvidia_icd.json");
    assert_eq!(machine.run(&[]).2, "setup: missing: driver\n");
    machine.file("dev/nvidia0");
    assert_eq!(machine.run(&[]), (Some(0), String::new(), String::new()));
}

#[test]
fn without_root_the_one_command_is_printed() {
    let machine = Machine::empty();
    machine.program("id", "echo 1000");
    machine.program("dnf", "");
    let (code, out, err) = machine.run(&[]);
    assert_eq!((code, out.as_str()), (Some(1), ""));
    assert!(err.ends_with("Type:  su -c 'dnf install -y vulkan-loader mesa-vulkan-drivers'\n"), "{err}");
    machine.program("sudo", "exit 1");
    let (code, _, err) = machine.run(&[]);
    assert_eq!(code, Some(1));
    assert!(err.contains("Type:  sudo sh -c 'dnf install -y vulkan-loader"), "{err}");
    machine.program("sudo", "exit 0");
    let (code, out, _) = machine.run(&[]);
    assert_eq!(
        (code, out.as_str()),
        (Some(0), "sudo -n sh -c dnf install -y vulkan-loader mesa-vulkan-drivers\n")
    );
}

#[test]
fn a_failed_installation_is_a_failure() {
    let machine = Machine::empty();
    machine.program("dnf", "exit 1");
    let (code, out, err) = outcome(machine.command(&[]).env_remove("SETUP_DRY_RUN").output().unwrap());
    assert_eq!((code, out.as_str()), (Some(1), ""));
    assert!(err.contains("that failed"), "{err}");
    machine.program("dnf", "exit 0");
    let (code, _, err) = outcome(machine.command(&[]).env_remove("SETUP_DRY_RUN").output().unwrap());
    assert_eq!(code, Some(1));
    assert!(err.contains("still missing after the installation: loader driver"), "{err}");
}

#[test]
fn what_cannot_be_installed_is_named() {
    let machine = Machine::empty();
    machine.complete();
    let hidden = machine.command(&[]).env("VK_DRIVER_FILES", "/nonexistent").output().unwrap();
    let (code, _, err) = outcome(hidden);
    assert_eq!(code, Some(1));
    assert!(err.contains("VK_DRIVER_FILES"), "{err}");
    machine.program("rustc", "echo rustc 1.63.0");
    assert!(machine.run(&[]).2.contains("rustup update stable"));
    fs::remove_file(machine.path("bin/cargo")).unwrap();
    let (code, _, err) = machine.run(&[]);
    assert_eq!(code, Some(1));
    assert!(err.contains("sh.rustup.rs"), "{err}");
}

#[test]
fn without_a_package_manager_the_needs_are_listed() {
    let (code, _, err) = Machine::empty().run(&[]);
    assert_eq!(code, Some(1));
    assert!(err.contains("no package manager") && err.contains("libvulkan.so.1"), "{err}");
}
