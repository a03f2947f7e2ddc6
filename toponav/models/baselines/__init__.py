"""The networks of the baselines that GraphNav is compared with: PhaseNet and BehavRNN."""
