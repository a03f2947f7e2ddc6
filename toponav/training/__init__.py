"""One readable recipe per trained model."""
