"""A show's workspace in QLC+ itself: after every cue its channels are held against the track sheet.

    python3 tests/peers/qlcplus.py target/release/footlight show.lxq

needs QLC+ 4 (Debian: `apt install qlcplus`) and `pip install websocket-client`. Nothing is shown and
nothing leaves the machine. A cue is waited for as long as it takes, so use a show of short cues.
Banks are plain or rgb, with a dimmer `linear` or `square`.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
import time

import websocket

PROGRAM, SHOW = sys.argv[1:3]


def decoded(code):
    code /= 255
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


def expected(folder):
    """By cue its number and the value of every channel, 0 to 255."""
    sheet = os.path.join(folder, "tracks.csv")
    subprocess.run([PROGRAM, "tracksheet", SHOW, "-o", sheet], check=True, stdout=subprocess.DEVNULL)
    text = open(SHOW, encoding="utf-8").read()
    banks = {}
    for line in re.findall(r"^bank .*$", text, re.M):
        line = line.split("//")[0]
        name, channel = line.split()[1], int(re.search(r"channel (\d+)", line)[1])
        banks[name] = (channel, "square" in line, bool(re.search(r"\brgb\b", line)))
    rows = list(csv.reader(open(sheet, encoding="utf-8")))
    for row in rows[1:]:
        values = {}
        for name, cell in zip(rows[0][2:], row[2:]):
            channel, square, rgb = banks[name]
            level = re.match(r"[\d.]+", cell)
            level = float(level[0]) / 100 if level else float("#" in cell)
            level = level**2 if square else level
            if not rgb:
                values[channel] = level
                continue
            colour = re.search(r"#([0-9a-f]{6})", cell)
            codes = bytes.fromhex(colour[1]) if colour else b"\xff\xff\xff"
            for emitter, code in enumerate(codes):
                values[channel + emitter] = level * decoded(code)
        yield row[0], {channel: 255 * value for channel, value in values.items()}


def lengths(workspace):
    """Seconds of each cue's fade."""
    text = open(workspace, encoding="utf-8").read()
    return [int(fade) / 1000 for fade in re.findall(r'<Step [^>]*FadeIn="(\d+)"', text)]


def connect():
    for _ in range(100):
        try:
            return websocket.create_connection("ws://127.0.0.1:9999/qlcplusWS", timeout=10)
        except OSError:
            time.sleep(0.3)
    sys.exit("QLC+ does not answer")


def values(socket, count):
    socket.send(f"QLC+API|getChannelsValues|1|1|{count}")
    while True:
        words = socket.recv().split("|")
        if words[:2] == ["QLC+API", "getChannelsValues"]:
            return {int(c): int(v) for c, v in zip(words[2::3], words[3::3])}


with tempfile.TemporaryDirectory() as folder:
    workspace = os.path.join(folder, "show.qxw")
    subprocess.run([PROGRAM, "export", SHOW, "-o", workspace], check=True)
    cues = list(expected(folder))
    environment = dict(os.environ, QT_QPA_PLATFORM="offscreen", HOME=folder)
    command = ["qlcplus", "--open", workspace, "--operate", "--web"]
    qlc = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        socket, worst = connect(), 0.0
        time.sleep(1)
        for position, ((number, wanted), length) in enumerate(zip(cues, lengths(workspace))):
            socket.send("0|PLAY" if position == 0 else "0|NEXT")
            time.sleep(length + 0.6)
            found = values(socket, max(wanted))
            off = max(abs(found[channel] - value) for channel, value in wanted.items())
            worst = max(worst, off)
            print(f"cue {number}: {off:.2f} of 255")
    finally:
        qlc.terminate()
        qlc.wait()
print(f"at most {worst:.2f} of 255 off")
sys.exit(worst > 1)
