"""Certificates for workers on other machines, made as the document says."""

import re
import subprocess

from tests import ROOT


def make_certificates(folder):
    """Run the commands of docs/workers.md in a folder; return the folder of the credentials."""
    text = (ROOT / 'docs/workers.md').read_text()
    commands = next(
        block for block in re.findall(r'```sh\n(.*?)```', text, re.DOTALL) if 'openssl' in block
    )
    subprocess.run(['sh', '-ec', commands], cwd=folder, check=True, capture_output=True)
    return folder / 'tls'
