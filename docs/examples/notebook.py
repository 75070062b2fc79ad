"""A notebook, cell by cell: python notebook.py [--quick]; --quick leaves out what takes minutes."""

# %% Read a response, and show it.
import sys

import lashbench as lb
from daq.configs import sample_path

response = lb.read(sample_path("adss-sweep"))
print(response)

# %% Anti-resonance and resonance at each source level.
features = lb.extract(response)
print(features)
picture = features.plot()
picture.savefig("features.png")
picture

# %% Backlash of each stage, and what the simulation gets wrong.
if "--quick" not in sys.argv:
    print(lb.estimate(response, unit="adss"))
    print(lb.diagnose(response, unit="adss"))

# %% The response as a picture.
picture = lb.plot(response, names=["sample"])
picture.savefig("response.png")
picture
