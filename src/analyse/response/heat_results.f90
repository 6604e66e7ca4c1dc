!> The power that couplings and shafts lose by their oscillation in a response, and the temperatures of rubber couplings.
module nocdyn_heat_results
  use nocdyn_column_lists, only: column_list_t
  use nocdyn_forced_response, only: forced_response_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_moment_forms, only: kind_moment
  use nocdyn_response_points, only: response_point_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: heat_values, list_heat, note_rubber, put_rubber, temperatures

contains

  !> Adds the columns of heat and temperature that stand beside a quantity: of the moment of a coupling, of a shaft the one at the
  !> first end.
  subroutine list_heat(response, q, list)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: q   !! quantity
    type(column_list_t), intent(inout) :: list

    if (.not. has_heat(response, q)) return
    associate (one => response%quantities(q))
      call list%add_named('heat', 'W', 'mean power lost by the oscillation', one%element_kind, one%element)
      if (heated(response, one%elements(1)) > 0) then
        call list%add_named('temperature', 'degC', 'steady temperature', one%element_kind, one%element)
      end if
    end associate
  end subroutine list_heat

  !> The values of these columns at a point.
  pure function heat_values(response, q, point) result(values)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: q   !! quantity
    type(response_point_t), intent(in) :: point
    real(wp), allocatable :: values(:)
    integer :: r

    allocate (values(0))
    if (.not. has_heat(response, q)) return
    values = [sum(point%heat(response%quantities(q)%elements))]
    r = heated(response, response%quantities(q)%elements(1))
    if (r > 0) values = [values, point%state%slopes%condition(r)%temperature]
  end function heat_values

  pure logical function has_heat(response, q)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: q

    associate (quantities => response%quantities)
      has_heat = quantities(q)%kind == kind_moment
      if (has_heat .and. q > 1) has_heat = .not. (quantities(q - 1)%kind == kind_moment .and. &
                                                 quantities(q - 1)%element == quantities(q)%element)
    end associate
  end function has_heat

  !> The rubber coupling that is an element and heats up, 0 if there is none.
  pure integer function heated(response, element)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: element   !! of the machine

    heated = 0
    if (.not. allocated(response%machine%rubber)) return
    heated = findloc(response%machine%rubber%element == element .and. response%machine%rubber%heats_up, .true., dim=1)
  end function heated

  !> The temperatures of a coupling at all points [degC]; empty if they are not found.
  pure function temperatures(response, element)
    type(forced_response_t), intent(in) :: response
    integer, intent(in) :: element   !! of the machine
    real(wp), allocatable :: temperatures(:)
    integer :: i, r

    allocate (temperatures(0))
    r = heated(response, element)
    if (r == 0) return
    temperatures = [(response%points(i)%state%slopes%condition(r)%temperature, i=1, size(response%points))]
  end function temperatures

  !> Notes the temperatures of the rubber couplings that heat up, how far their stiffness falls by them, and speeds at which the
  !> conditions were not found.
  subroutine note_rubber(response, notes)
    type(forced_response_t), intent(in) :: response
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp), allocatable :: temperature(:)
    character(len=:), allocatable :: beyond
    integer :: i, r, unsettled, worst

    if (.not. allocated(response%machine%rubber)) return
    do r = 1, size(response%machine%rubber)
      associate (law => response%machine%rubber(r), points => response%points)
        temperature = temperatures(response, law%element)
        if (size(temperature) > 0) then
          worst = maxloc(temperature, dim=1)
          beyond = ''
          if (temperature(worst) > law%by_temperature%last_point()) beyond = ', as at ' // &
            rounded_text(law%by_temperature%last_point(), 4) // ' degC, where its table ends'
          call append(notes, 'coupling ' // quoted(response%machine%element_name(law%element)) // ' is heated by its losses ' // &
                             'from ' // rounded_text(law%ambient, 4) // ' to ' // rounded_text(temperature(worst), 4) // &
                             ' degC at ' // rounded_text(response%axis%shown(points(worst)%state%speed), 6) // ' ' // &
                             response%axis%unit() // ': there its stiffness is ' // &
                             rounded_text(100.0_wp * law%by_temperature%stiffness(temperature(worst)) / &
                                          law%by_temperature%stiffness(law%ambient), 3) // ' % of the cold one, and its ' // &
                             'relative damping ' // rounded_text(100.0_wp * law%by_temperature%damping(temperature(worst)) / &
                                                                 law%by_temperature%damping(law%ambient), 3) // ' %' // beyond)
        end if
      end associate
    end do
    unsettled = count([(.not. response%points(i)%is_settled, i=1, size(response%points))])
    if (unsettled > 0) call append(notes, 'the temperatures or amplitudes of rubber couplings were not found to 1e-9 at ' // &
                                          to_text(unsettled) // ' of ' // to_text(size(response%points)) // ' ' // &
                                          response%axis%plural())
  end subroutine note_rubber

  !> Lists the highest temperatures of rubber couplings.
  subroutine put_rubber(json, response)
    type(json_t), intent(inout) :: json
    type(forced_response_t), intent(in) :: response
    real(wp), allocatable :: temperature(:)
    integer :: r, worst

    if (.not. allocated(response%machine%rubber)) return
    if (.not. any(response%machine%rubber%heats_up)) return
    call json%open_list('temperatures')
    do r = 1, size(response%machine%rubber)
      associate (law => response%machine%rubber(r))
        temperature = temperatures(response, law%element)
        if (size(temperature) == 0) cycle
        worst = maxloc(temperature, dim=1)
        call json%open()
        call json%put('coupling', response%machine%element_name(law%element))
        call json%put('ambient_degC', law%ambient)
        call json%put('highest_degC', temperature(worst))
        call json%put(response%axis%key('highest_'), response%axis%stored(response%points(worst)%state%speed))
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_rubber

end module nocdyn_heat_results
