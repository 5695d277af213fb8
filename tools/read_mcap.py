#!/usr/bin/env python3
"""Prints what a record holds: each topic, its number of messages, and the last of them.

    python3 -m pip install -r tools/requirements.txt
    python3 tools/read_mcap.py REC-0001.mcap
"""
import sys

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap_ros2.decoder import DecoderFactory

if len(sys.argv) != 2:
    sys.exit(__doc__)

counts, last, ending = {}, {}, None
with open(sys.argv[1], "rb") as stream:
    # Reads from front to back, so that a record without an end (the recorder was killed) opens too.
    reader = NonSeekingReader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
    try:
        messages = reader.iter_decoded_messages(log_time_order=False)
        for _schema, channel, _message, decoded in messages:
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            last[channel.topic] = decoded
    except McapError as error:
        ending = error

for topic in sorted(counts):
    print(f"{topic}: {counts[topic]} messages, the last one:")
    for name in last[topic].__slots__:
        print(f"    {name} = {getattr(last[topic], name)}")
if ending is not None:
    print(f"The record has no proper end ({type(ending).__name__}); all before it was read.")
