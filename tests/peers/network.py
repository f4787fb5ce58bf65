"""What is sent, as others receive it: OLA and the Python package `sacn`.

    unshare --net python3 tests/peers/network.py target/release/footlight

needs root (or `unshare --user --map-root-user --net`), OLA (Debian: `apt install ola`) and `pip install sacn`.
In a network namespace of its own, with an interface that leads nowhere, no packet leaves the machine. Prints
what each receiver has after each cue, and fails where a value is more than 1 of 255 off.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

import sacn

PROGRAM = os.path.abspath(sys.argv[1])
ADDRESS = "10.77.0.1"
# OLA does not hear what comes from its own address.
SENDER = "10.77.0.2"
# OLA's universe whose lower four bits are Art-Net's universe 0.
ARTNET = "16"
SHOW = """show "Network"
bank lamps channel 1
bank wash  channel 2  dimmer square
bank sky   channel 3  rgb
cue 1 { snap  lamps 30  sky full #ff8000  follow 4 }
cue 2 { time 1  lamps full  wash 50  follow 4 }
cue 3 { time 1  lamps 10  wash out  sky 50  follow 4 }
cue 4 { time 1  blackout }
"""
# After each cue: 255 times the light of each address.
ORANGE = ((0x80 / 255 + 0.055) / 1.055) ** 2.4
WANTED = [
    [76.5, 0, 255, 255 * ORANGE, 0],
    [255, 63.75, 255, 255 * ORANGE, 0],
    [25.5, 0, 127.5, 127.5 * ORANGE, 0],
]


def run(*command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def interface():
    others = {line.split(":")[1].strip() for line in os.popen("ip -o link").read().splitlines()}
    if others - {"lo"}:
        sys.exit("this is no network namespace of its own: unshare --net python3 …")
    run("ip", "link", "set", "lo", "up")
    run("ip", "link", "add", "stage", "type", "veth", "peer", "name", "wings")
    run("ip", "link", "set", "wings", "up")
    for address in [ADDRESS, SENDER]:
        run("ip", "addr", "add", f"{address}/24", "dev", "stage")
    run("ip", "link", "set", "stage", "up", "multicast", "on")
    run("ip", "route", "add", "224.0.0.0/4", "dev", "stage")


def olad(folder):
    """OLA as an ordinary user, with E1.31 on universe 1 and Art-Net on universe 16."""
    for name, text in {"e131": f"enabled = true\nip = {ADDRESS}\n", "artnet": f"enabled = true\nip = {ADDRESS}\n"}.items():
        with open(os.path.join(folder, f"ola-{name}.conf"), "w") as file:
            file.write(text)
    for name in ["usbserial", "stageprofi", "opendmx", "usbpro", "gpio", "spi", "uartdmx", "usbdmx", "ftdidmx", "dmx4linux"]:
        with open(os.path.join(folder, f"ola-{name}.conf"), "w") as file:
            file.write("enabled = false\n")
    shutil.chown(folder, "nobody")
    for name in os.listdir(folder):
        shutil.chown(os.path.join(folder, name), "nobody")
    command = ["setpriv", "--reuid=nobody", "--clear-groups", "olad", "-c", folder, "--http-port", "9090"]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for _ in range(100):
        time.sleep(0.2)
        devices = subprocess.run(["ola_dev_info"], capture_output=True, text=True).stdout
        if "E1.31" in devices and "ArtNet" in devices:
            break
    for line in devices.splitlines():
        if line.startswith("Device "):
            number = line.split()[1].rstrip(":")
            for universe, name in [("1", "E1.31"), (ARTNET, "ArtNet")]:
                if name in line:
                    run("ola_patch", "-d", number, "-p", "0", "-i", "-u", universe)
    return server


def held(universe):
    with urllib.request.urlopen(f"http://127.0.0.1:9090/get_dmx?u={universe}") as answer:
        return json.load(answer)["dmx"]


interface()
with tempfile.TemporaryDirectory() as folder:
    os.chmod(folder, 0o755)
    show = os.path.join(folder, "network.lxq")
    with open(show, "w") as file:
        file.write(SHOW)
    config = os.path.join(folder, "ola")
    os.mkdir(config)
    server = olad(config)
    receiver, last, ended = sacn.sACNreceiver(bind_address=ADDRESS), {}, []
    receiver.start()
    receiver.join_multicast(1)

    @receiver.listen_on("universe", universe=1)
    def received(packet):
        last["sacn"] = packet.dmxData

    @receiver.listen_on("availability")
    def available(universe, changed):
        ended.append((universe, changed))

    worst = 0.0
    command = [PROGRAM, "send", show, "--sacn", "1", "--artnet", ADDRESS, "--bind", SENDER]
    program = subprocess.Popen(command)
    begun = time.time()
    try:
        for cue, wanted in enumerate(WANTED):
            time.sleep(max(0.0, begun + 4 * cue + 3 - time.time()))
            for name, values in [("sacn", last.get("sacn", ())), ("OLA E1.31", held(1)), ("OLA Art-Net", held(ARTNET))]:
                found = list(values[:5])
                off = max((abs(f - w) for f, w in zip(found, wanted)), default=255.0)
                worst = max(worst, off if found else 255.0)
                print(f"cue {cue + 1}: {name} has {found}, {off:.2f} off")
        program.wait(30)
        time.sleep(1)
        print("the stream of universe 1:", [changed for universe, changed in ended if universe == 1])
    finally:
        receiver.stop()
        server.terminate()
        server.wait()
sys.exit(worst > 1)
