"""Clients of others, from a folder of their own: `make clients` puts them there."""

import sys
from pathlib import Path

FOLDER = Path(__file__).parents[2] / ".venv" / "clients"
sys.path.append(str(FOLDER))
