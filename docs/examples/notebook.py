"""A notebook, cell by cell: python notebook.py [--quick]; --quick leaves out what takes minutes."""

import sys

import lashbench as lb
from daq.configs import sample_path

# %% Read a response, and show it.
response = lb.read(sample_path("adss-sweep"))
print(response)

# %% Anti-resonance and resonance at each source level.
features = lb.extract(response)
print(features)
features.plot().savefig("features.png")

# %% Backlash of each stage, and what the simulation gets wrong.
if "--quick" not in sys.argv:
    print(lb.estimate(response, unit="adss"))
    print(lb.diagnose(response, unit="adss"))

# %% The response as a picture.
lb.plot(response, names=["sample"]).savefig("response.png")
