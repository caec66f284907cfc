"""What results look like, a module per subject: `tables` for people, `as_json` for programs."""
