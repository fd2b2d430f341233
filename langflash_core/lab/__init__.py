"""The lab: what makes the weights and judges them. The product never imports it."""
